"""Planted faults: everything comes back by itself, and how soon.

What is wanted stands in the table that is printed at the end; the tests fail on what does not come
back, on restarts that should not be, on wrong poses, and on what is left over.
"""

from __future__ import annotations

import re
import signal
import time

import pytest

from rhot import topics
from testing.hosts.hosted_rig import MASTER
from testing.hosts.planted import HANG_S, planted
from testing.hosts.rig_files import NAME

# The first test waits for the installation, and kernels take minutes where none are kept.
pytestmark = [pytest.mark.system, pytest.mark.timeout(1800)]

# What is wanted of a process, and of a link from its return.
PROCESS_S, LINK_S = 2.0, 1.0
# Host and unit of every process that rhot runs here.
UNITS = [
    ("left", "rhot-pi-tracker@left"),
    ("right", "rhot-pi-tracker@right"),
    (MASTER, "rhot-router"),
    (MASTER, "rhot-fusion"),
    (MASTER, "rhot-object-tracker"),
    (MASTER, "rhot-viewer"),
    (MASTER, "rhot-recorder"),
    (MASTER, "rhot-simulator"),
]
# A Pi whose camera has gone is back when its frames are: NTP may set a clock by seconds.
CLOCK_STEP_NS = 2 * 10**9
# Longer than WatchdogSec, TimeoutAbortSec and a restart.
WATCHDOG_S = 20.0


def test_everything_runs_as_installed(rig, watch):
    """Every unit is there, started once by systemd, and watched by it."""
    for host, unit in UNITS:
        shown = rig.hosts[host].show(
            f"{unit}.service", "ActiveState", "NRestarts", "User", "WatchdogUSec", "UnitFileState"
        )
        assert shown["ActiveState"] == "active", f"{unit}: {shown}\n{rig.journals()}"
        assert shown["User"] == "rhot"
        assert shown["WatchdogUSec"] not in ("", "0", "infinity"), unit
    errors_m = [pose.error_m for pose in watch.poses if pose.live and pose.error_m is not None]
    assert len(errors_m) >= 10, watch.poses[-20:]
    assert sorted(errors_m)[len(errors_m) // 2] < 0.03


def test_threads_let_the_event_loop_have_its_turn(rig, watch):
    """Also in the sandbox, which forbids most other system calls of that kind."""
    main = rig.master.show("rhot-fusion.service", "MainPID")["MainPID"]
    said = rig.master.run("chrt", "--all-tasks", "--pid", main)
    policies = re.findall(r"pid (\d+)'s current scheduling policy: (\w+)", said)
    others = {policy for thread, policy in policies if thread != main}
    assert dict(policies)[main] == "SCHED_OTHER", said
    assert others == {"SCHED_BATCH"}, said


@pytest.mark.parametrize(("host", "unit"), UNITS, ids=[unit for _, unit in UNITS])
def test_a_killed_service_comes_back(rig, watch, table, host, unit):
    with planted(rig, watch, table, f"kill -9 of {unit}", PROCESS_S) as fault:
        rig.hosts[host].kill(f"{unit}.service", signal.SIGKILL)
        fault.services.append((rig.hosts[host], f"{unit}.service"))
    assert table.rows[-1].restarts == 1


@pytest.mark.parametrize(
    ("host", "unit"), [("left", "rhot-pi-tracker@left"), (MASTER, "rhot-fusion")]
)
def test_a_stuck_service_is_restarted_by_the_watchdog(rig, watch, table, host, unit):
    """No goal of seconds: a stuck loop is noticed after WatchdogSec, by choice."""
    with planted(rig, watch, table, f"SIGSTOP of {unit}", WATCHDOG_S) as fault:
        rig.hosts[host].kill(f"{unit}.service", signal.SIGSTOP)
        fault.services.append((rig.hosts[host], f"{unit}.service"))
    assert table.rows[-1].restarts == 1


@pytest.mark.parametrize("seconds", [1, 8, 15])
def test_a_pi_is_unplugged(rig, watch, table, seconds):
    with planted(rig, watch, table, f"a Pi unplugged for {seconds} s", LINK_S) as fault:
        rig.network.unplug("left")
        time.sleep(seconds)
        rig.network.plug("left")
        fault.cured()
    assert table.rows[-1].restarts == 0


@pytest.mark.parametrize("step_ns", [CLOCK_STEP_NS, 0], ids=["ahead", "back"])
def test_a_pis_clock_is_set(rig, watch, table, step_ns):
    """Ahead by two seconds, then back again: no pose may be wrong meanwhile."""
    word = "ahead" if step_ns else "back"
    with planted(rig, watch, table, f"a Pi's clock set 2 s {word}", LINK_S):
        said = rig.zenoh_get(topics.SIM_CLOCK.key(NAME, camera="left"), f'{{"ahead_ns":{step_ns}}}')
        assert f'"ahead_ns":{step_ns}' in said
    assert table.rows[-1].wrong_poses == 0
    assert table.rows[-1].restarts == 0


def test_the_recorders_disk_is_full(rig, watch, table):
    """Poses go on, the recorder says why it records nothing, and records again on a free disk."""
    folder, unit, master = "/var/lib/rhot/recordings", "rhot-recorder.service", rig.master
    master.run("systemctl", "stop", unit)
    # More than what must be free for it to go on (services/recorder/recorder.py).
    options = "size=160m,mode=2775,uid=rhot,gid=rhot"
    master.run("mount", "-t", "tmpfs", "-o", options, "none", folder)
    master.run("systemctl", "start", unit)
    assert watch.wait_value("recorder", "recording", 1.0, HANG_S), rig.journals()
    with planted(rig, watch, table, "the recorder's disk full", PROCESS_S):
        # As somebody else's files do; the command fails once the disk is full.
        master.try_run("dd", "if=/dev/zero", f"of={folder}/other", "bs=1M", "count=200")
        assert watch.wait_fault("recorder", "disk_full", HANG_S), rig.journals()
        master.run("rm", f"{folder}/other")
        assert watch.wait_value("recorder", "recording", 1.0, HANG_S), rig.journals()
    assert table.rows[-1].restarts == 0
    master.run("systemctl", "stop", unit)
    master.run("umount", "-l", folder)
    master.run("systemctl", "start", unit)


def test_the_master_is_rebooted(rig, watch, table):
    """Counted from the power button; the Pis find it again, nothing on them restarts."""
    pis = [host for name, host in rig.hosts.items() if name != MASTER]
    before = sum(host.restarts() for host in pis)
    with planted(rig, watch, table, "the master rebooted", None) as fault:
        rig.master.power_off()
        fault.cured()
        rig.master.boot()
        fault.services += [
            (rig.master, f"{unit}.service") for host, unit in UNITS if host == MASTER
        ]
    assert sum(host.restarts() for host in pis) == before


def test_nothing_is_left_when_all_is_stopped(rig, watch, table):
    """Last of all: the targets stop their services, and no process of rhot stays behind."""
    for name, host in rig.hosts.items():
        host.run("systemctl", "stop", "rhot-*.target", "rhot-*.service", timeout_s=60.0)
        left = host.processes("rhot")
        table.processes_left += [f"{name}: {line}" for line in left]
    assert table.processes_left == []
