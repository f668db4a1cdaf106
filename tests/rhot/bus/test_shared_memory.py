"""What most users may lock of memory is little: no message may be lost for it."""

from __future__ import annotations

import os
import resource
import subprocess
import sys

from rhot.bus.zenoh_config import may_lock

# A rig's router and some programs in one process. It prints how many messages of each size came.
_RIG = """
import os, resource, sys, time
resource.setrlimit(resource.RLIMIT_MEMLOCK, (8 << 20, 8 << 20))
import zenoh
from rhot.bus.zenoh_config import client_config, router_config
endpoint = sys.argv[1]
router = zenoh.open(router_config([endpoint]))
senders = [zenoh.open(client_config([endpoint])) for _ in range(5)]
reader = zenoh.open(client_config([endpoint]))
came, greeted = {}, set()
def note(sample):
    payload = sample.payload.to_bytes()
    came[len(payload)] = came.get(len(payload), 0) + 1
    if len(payload) == 1:
        greeted.add(payload)
subscriber = reader.declare_subscriber("test/**", note)
deadline = time.monotonic() + 30
# Until all have heard of the subscriber, what they send is lost.
while len(greeted) < 5 and time.monotonic() < deadline:
    for number, sender in enumerate(senders):
        sender.put("test/hello", bytes([number]))
    time.sleep(0.2)
block = zenoh.CongestionControl.BLOCK
for _ in range(10):
    for sender in senders:
        sender.put("test/pose", bytes(9_000), congestion_control=block)
    senders[0].put("test/image", bytes(300_000), congestion_control=block)
    # A rig's pace: a burst of megabytes is dropped on a busy machine, as it should be.
    time.sleep(0.05)
while (came.get(9_000), came.get(300_000)) != (50, 10) and time.monotonic() < deadline:
    time.sleep(0.05)
print(came.get(9_000), came.get(300_000), flush=True)
os._exit(0)
"""


def test_poses_and_pictures_come_through_where_little_may_be_locked(endpoint):
    command = [sys.executable, "-c", _RIG, endpoint]
    if os.geteuid() == 0:
        # root may lock what it likes; a service or a user may not.
        command = ["setpriv", "--bounding-set", "-ipc_lock", *command]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True)
    assert done.stdout.split() == ["50", "10"]


def test_the_limit_is_known():
    limit, _ = resource.getrlimit(resource.RLIMIT_MEMLOCK)
    assert may_lock(0)
    if os.geteuid() != 0 and limit != resource.RLIM_INFINITY:
        assert not may_lock(limit + 1)
