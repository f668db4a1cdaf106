"""`rhot check && rhot up` on a rig of two Pis and a master: three hosts with a LAN of their own,
mTLS, real trackers of simulated cameras on the Pis, and no manual step.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import msgspec
import pytest

from rhot.files.calibration import load_colors, save
from services.cli.defaults import config_dir
from testing.hosts.commands import run
from testing.hosts.network import Network, lan

pytestmark = [
    pytest.mark.field,
    pytest.mark.skipif(
        os.geteuid() != 0 or not shutil.which("ip"),
        reason="needs root and iproute2 for network namespaces",
    ),
]
BIN = Path(sys.executable).parent
# numba's first compilation on a loaded machine takes most of it.
START_S, END_S = 240.0, 30.0
CAMERAS = ("left", "right")


class Hosts:
    """The hosts' folders, as /etc/rhot on real ones, and what runs on them."""

    def __init__(self, network: Network, folder: Path) -> None:
        self.network, self.folder = network, folder
        self.running: dict[str, subprocess.Popen[bytes]] = {}

    def rig_toml(self, host: str) -> Path:
        return self.folder / host / "rig.toml"

    def command(self, host: str, program: str, *words: str) -> list[str]:
        namespace = self.network.namespace(host)
        return ["ip", "netns", "exec", namespace, str(BIN / program), *words]

    def check(self, host: str, *options: str) -> tuple[int, str]:
        """Exit code and text of `rhot check` on a host."""
        words = self.command(host, "rhot", "check", str(self.rig_toml(host)), *options)
        done = subprocess.run(words, capture_output=True, text=True, timeout=60, check=False)
        return done.returncode, done.stdout + done.stderr

    def start(self, host: str, program: str, *words: str) -> Path:
        """A process on a host; the file of its output."""
        log = self.folder / f"{host}.log"
        with log.open("ab") as file:
            self.running[host] = subprocess.Popen(
                self.command(host, program, *words), stdout=file, stderr=subprocess.STDOUT
            )
        return log

    def pids(self, host: str) -> list[str]:
        return run(["ip", "netns", "pids", self.network.namespace(host)]).split()


@pytest.fixture(scope="module")
def hosts(tmp_path_factory) -> Iterator[Hosts]:
    """The three hosts, each with its part of a calibrated rig and its certificate."""
    with lan("master", *CAMERAS) as network, contextlib.ExitStack() as stack:
        found = Hosts(network, tmp_path_factory.mktemp("two-pis"))
        master = network.addresses["master"]
        at = [f"--camera={name}=simulator@{network.addresses[name]}" for name in CAMERAS]
        rig_toml = found.rig_toml("master")
        run([BIN / "rhot", "init", rig_toml, "--yes", "--name=two", f"--master={master}", *at])
        run([BIN / "rhot", "pki", "init", "--config", rig_toml])
        shipped = config_dir() / "calibration"
        for host in ("master", *CAMERAS):
            folder = found.rig_toml(host).parent
            folder.mkdir(exist_ok=True)
            if host != "master":
                shutil.copy(rig_toml, folder)
            kinds = ("lens", "rig") if host == "master" else ("colors", "exposure")
            (folder / "calibration").mkdir()
            for path in shipped.glob("*.json"):
                if path.stem == "rig" and "rig" in kinds:
                    shutil.copy(path, folder / "calibration")
                name, _, kind = path.stem.partition(".")
                if kind in kinds and host in ("master", name):
                    shutil.copy(path, folder / "calibration")
            shutil.copytree(rig_toml.parent / "pki-hosts" / host, folder / "pki")
        stack.callback(end_all, found)
        yield found


def end_all(hosts: Hosts) -> None:
    for process in hosts.running.values():
        if process.poll() is None:
            process.terminate()
    for process in hosts.running.values():
        try:
            process.wait(END_S)
        except subprocess.TimeoutExpired:
            process.kill()


def until(condition, seconds: float, log: Path) -> None:
    deadline_s = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline_s, log.read_text()[-4000:]
        time.sleep(0.1)


def test_check_and_up_without_a_manual_step(hosts):
    code, said = hosts.check("master")
    assert code == 0, said
    assert "no router answers" in said
    assert "colors.json" not in said
    log = hosts.start("master", "rhot", "up", str(hosts.rig_toml("master")), "--no-viewer")
    for camera in CAMERAS:
        config = str(hosts.rig_toml(camera))
        hosts.start(camera, "rhot-pi-tracker", "--config", config, "--camera", camera)
    until(lambda: "rig 'two' is up" in log.read_text(), START_S, log)


def test_the_running_rig_is_sound_from_everywhere(hosts):
    code, said = hosts.check("master")
    assert code == 0, said
    assert "rig 'two' is running: fusion, pi_tracker" in said
    assert "cannot be checked from here" not in said
    for camera in CAMERAS:
        code, said = hosts.check(camera, "--strict")
        assert code == 0, said
        # Lenses and rig.json are the master's.
        assert "lens.json" not in said
        assert "rig.json" not in said


def test_a_colour_that_a_pi_lacks_is_an_error_on_the_master_and_there(hosts):
    folder = hosts.rig_toml("right").parent / "calibration"
    whole = load_colors(folder, "right")
    colors = {name: bounds for name, bounds in whole.colors.items() if name != "blue"}
    hosts.running["right"].terminate()
    hosts.running["right"].wait(END_S)
    code, said = hosts.check("master")
    assert code == 0, said
    assert "tracker of right on 10.77.0.3: is not running" in said
    save(folder / "right.colors.json", msgspec.structs.replace(whole, colors=colors))
    config = str(hosts.rig_toml("right"))
    log = hosts.start("right", "rhot-pi-tracker", "--config", config, "--camera", "right")
    until(lambda: hosts.check("master")[0] == 1, END_S, log)
    _, said = hosts.check("master")
    assert "error  tracker of right on 10.77.0.3: colour 'blue'" in said
    code, said = hosts.check("right")
    assert code == 1
    assert "colour 'blue' of the right hand's" in said
    assert "is missing" in said
    save(folder / "right.colors.json", whole)
    until(lambda: hosts.check("master")[0] == 0, END_S, log)


def test_a_wrong_certificate_is_named(hosts):
    pki = hosts.rig_toml("left").parent / "pki"
    pki.rename(pki.with_name("mine"))
    try:
        code, said = hosts.check("left")
        assert code == 1
        assert "ca.pem" in said
        shutil.copytree(hosts.rig_toml("right").parent / "pki", pki)
        code, said = hosts.check("left")
        assert code == 1
        assert "certificate is two.camera.right, and rig.toml calls for two.camera.left" in said
    finally:
        shutil.rmtree(pki, ignore_errors=True)
        pki.with_name("mine").rename(pki)


def test_the_wrong_machine_is_told_where_the_master_is(hosts):
    """rig.toml of a master that has got another address meanwhile."""
    path = hosts.folder / "moved.toml"
    text = hosts.rig_toml("master").read_text().replace(hosts.network.addresses["master"], "")
    path.write_text(text.replace("tls/:7448", "tls/10.77.0.99:7448"))
    words = hosts.command("master", "rhot", "check", str(path))
    said = subprocess.run(words, capture_output=True, text=True, timeout=60, check=False).stdout
    assert "10.77.0.99 is not this machine" in said


def test_ctrl_c_leaves_nothing_behind(hosts):
    for camera in CAMERAS:
        hosts.running[camera].terminate()
    hosts.running["master"].send_signal(signal.SIGINT)
    assert hosts.running["master"].wait(END_S) == 0
    until(lambda: not hosts.pids("master"), END_S, hosts.folder / "master.log")
