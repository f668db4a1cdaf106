"""`rhot pki`, run as a user runs it: files, rights, names, renewal."""

from __future__ import annotations

import stat

import pytest
from cryptography import x509
from typer.testing import CliRunner

from rhot.bus.security.credentials import Credentials
from rhot.bus.security.tls_diagnosis import own_problem, read_own_certificate
from rhot.errors import BusError, ConfigError
from services.cli.application import application
from services.cli.pki.certificates import hosts_of
from testing.secured_rig import NOW

RIG = """
[rig]
name = "desk"
[bus]
connect = ["tcp/127.0.0.1:7447", "tls/master.example:7448", "tls/192.168.7.1:7448"]
viewers = ["laptop"]
object_sources = ["steamvr"]
[[camera]]
name = "left"
host = "pi-left"
[[camera]]
name = "low"
host = "pi-left"
[[camera]]
name = "right"
host = "10.0.0.2"
"""


@pytest.fixture
def run(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "rig.toml").write_text(RIG)

    def call(*arguments: str) -> str:
        result = CliRunner().invoke(application(), ["pki", *arguments])
        if result.exception is not None and not isinstance(result.exception, SystemExit):
            raise result.exception
        assert result.exit_code == 0, result.output
        return result.output

    return call


def certificate(folder, name: str) -> x509.Certificate:
    return x509.load_pem_x509_certificate((folder / "pki-hosts" / name / "own.pem").read_bytes())


def test_init_makes_a_certificate_for_every_host_that_rig_toml_names(run, tmp_path):
    run("init", "--config", "rig.toml", "--host", "10.0.0.1")
    hosts = tmp_path / "pki-hosts"
    # The two cameras of pi-left share one.
    names = {path.name for path in hosts.iterdir()}
    assert names == {"authority", "master", "left", "right", "laptop", "steamvr"}
    for name in names - {"authority"}:
        files = Credentials.of(hosts / name)
        assert own_problem(files, NOW.timestamp()) is None
        assert stat.S_IMODE(files.key.stat().st_mode) == 0o600
        assert stat.S_IMODE(files.key.parent.stat().st_mode) == 0o700
    assert read_own_certificate(Credentials.of(hosts / "left")).common_name == "desk.camera.left"
    assert {"master.example", "192.168.7.1", "10.0.0.1", "localhost"} <= set(
        hosts_of(certificate(tmp_path, "master"))
    )
    assert hosts_of(certificate(tmp_path, "left")) == ["pi-left", "pi-left.local"]
    assert hosts_of(certificate(tmp_path, "right")) == ["10.0.0.2"]


def test_only_the_master_can_pose_as_a_server(run, tmp_path):
    run("init", "--config", "rig.toml")

    def usages(name: str) -> set[str]:
        found = certificate(tmp_path, name).extensions
        return {oid._name for oid in found.get_extension_for_class(x509.ExtendedKeyUsage).value}

    assert usages("master") == {"clientAuth", "serverAuth"}
    assert usages("left") == usages("laptop") == {"clientAuth"}


def test_nothing_is_overwritten(run):
    run("init", "--config", "rig.toml")
    with pytest.raises(BusError, match="there is an authority"):
        run("init", "--config", "rig.toml")
    with pytest.raises(BusError, match="exists already"):
        run("issue", "left")


def test_issue_says_what_comes_next(run, tmp_path):
    run("init", "--config", "rig.toml")
    said = run("issue", "tablet", "--role", "viewer", "--host", "tablet")
    assert "desk.viewer.tablet" in said
    assert "[bus] viewers" in said
    assert hosts_of(certificate(tmp_path, "tablet")) == ["tablet", "tablet.local"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("issue", "x", "--role", "king"), "valid: camera, master"),
        (("issue", "x", "--role", "master"), "is called master"),
        (("issue", "master", "--role", "camera"), "is called master"),
        (("issue", "a b"), "cannot stand in a certificate's name"),
        (("issue", "../x"), "cannot stand in a certificate's name"),
        (("issue", "x" * 60), "longer than 64"),
        (("issue", "authority"), "choose another name"),
        (("issue", "x", "--host", "ünmöglich"), "neither a host name nor an address"),
        (("renew", "nobody"), "rhot pki issue nobody"),
    ],
)
def test_what_cannot_be_is_refused_in_words(run, arguments, message):
    run("init", "--config", "rig.toml")
    with pytest.raises(BusError, match=message):
        run(*arguments)


def test_without_an_authority(run):
    for arguments in (("issue", "x"), ("renew",), ("list",)):
        with pytest.raises(BusError, match="rhot pki init"):
            run(*arguments)
    with pytest.raises(ConfigError):
        run("init", "--config", "absent.toml")


def test_one_name_for_two_hosts_is_refused_before_anything_is_written(run, tmp_path):
    twice = RIG.replace('viewers = ["laptop"]', 'viewers = ["left"]')
    (tmp_path / "rig.toml").write_text(twice)
    with pytest.raises(BusError, match="left"):
        run("init", "--config", "rig.toml")
    assert not (tmp_path / "pki-hosts").exists()


def test_renew_keeps_the_key_unless_a_new_one_is_asked_for(run, tmp_path):
    run("init", "--config", "rig.toml")
    key = tmp_path / "pki-hosts" / "left" / "own.key"
    before, old = key.read_bytes(), certificate(tmp_path, "left")
    assert "Bring own.pem of each" in run("renew")
    new = certificate(tmp_path, "left")
    assert key.read_bytes() == before
    assert new.serial_number != old.serial_number
    assert (new.subject, hosts_of(new)) == (old.subject, hosts_of(old))
    assert "own.key" in run("renew", "left", "--new-key")
    assert key.read_bytes() != before
    assert own_problem(Credentials.of(key.parent), NOW.timestamp()) is None


def test_renew_gives_the_master_another_name(run, tmp_path):
    run("init", "--config", "rig.toml")
    run("renew", "--host", "other.example")
    assert "other.example" in hosts_of(certificate(tmp_path, "master"))
    assert "other.example" not in hosts_of(certificate(tmp_path, "left"))


def test_list_shows_who_has_what_and_for_how_long(run):
    run("init", "--config", "rig.toml")
    lines = run("list").splitlines()
    assert lines[0].split()[:2] == ["FOLDER", "ROLE"]
    left = next(line for line in lines if line.startswith("left"))
    assert "camera" in left
    assert " 729 " in left
    assert "pi-left.local" in left
    assert any(line.startswith("authority") and " 3651 " in line for line in lines)
