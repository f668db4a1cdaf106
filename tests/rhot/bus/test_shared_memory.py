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
came = {}
def note(sample):
    size = len(sample.payload.to_bytes())
    came[size] = came.get(size, 0) + 1
subscriber = reader.declare_subscriber("test/**", note)
deadline = time.monotonic() + 30
# Until all have heard of the subscriber, what they send is lost.
while came.get(1, 0) < 5 and time.monotonic() < deadline:
    came.clear()
    for sender in senders:
        sender.put("test/hello", b"x")
    time.sleep(0.2)
for _ in range(10):
    for sender in senders:
        # On a busy machine others would be dropped for want of time.
        sender.put("test/pose", bytes(9_000), congestion_control=zenoh.CongestionControl.BLOCK)
        sender.put("test/image", bytes(300_000), congestion_control=zenoh.CongestionControl.BLOCK)
while (came.get(9_000), came.get(300_000)) != (50, 50) and time.monotonic() < deadline:
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
    assert done.stdout.split() == ["50", "50"]


def test_the_limit_is_known():
    limit, _ = resource.getrlimit(resource.RLIMIT_MEMLOCK)
    assert may_lock(0)
    if os.geteuid() != 0 and limit != resource.RLIM_INFINITY:
        assert not may_lock(limit + 1)
