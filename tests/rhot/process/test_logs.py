"""The three ways to log, by real processes on a real terminal, a pipe and a journal's socket."""

from __future__ import annotations

import json
import os
import pty
import re
import socket
import subprocess
import sys

import pytest

SCRIPT = """
import logging
from rhot.process import logs
logs.set_up("fusion/main")
logging.getLogger("x").info("calm")
logging.getLogger("x").warning("a \\x1b[31mred\\nlie")
try:
    raise KeyError("gone")
except KeyError as error:
    logging.getLogger("x").error("a bug", exc_info=error)
"""
COMMAND = [sys.executable, "-c", SCRIPT]


def environment(**changes):
    own = {k: v for k, v in os.environ.items() if k not in ("JOURNAL_STREAM", "RHOT_LOG")}
    return {**own, **changes}


def test_a_terminal_gets_times():
    ours, theirs = pty.openpty()
    subprocess.run(COMMAND, stdout=theirs, check=True, env=environment())
    os.close(theirs)
    lines = os.read(ours, 65536).decode().splitlines()
    os.close(ours)
    assert re.fullmatch(r"\d\d:\d\d:\d\d fusion/main: calm", lines[0])
    assert re.fullmatch(r"\d\d:\d\d:\d\d fusion/main warning: a  \[31mred lie", lines[1])
    assert lines[-1].endswith("fusion/main error: KeyError: 'gone'")


def test_a_file_gets_the_day_too():
    said = subprocess.run(COMMAND, check=True, capture_output=True, env=environment()).stdout
    assert re.match(rb"\d{4}-\d\d-\d\d \d\d:\d\d:\d\d fusion/main: calm\n", said)


def test_the_journal_gets_priorities_and_no_times():
    ours, theirs = socket.socketpair()
    status = os.fstat(theirs.fileno())
    journal = environment(JOURNAL_STREAM=f"{status.st_dev}:{status.st_ino}")
    subprocess.run(COMMAND, stdout=theirs, check=True, env=journal)
    theirs.close()
    lines = ours.makefile().read().splitlines()
    ours.close()
    assert lines[:2] == ["<6>calm", "<4>a  [31mred lie"]
    assert all(line.startswith("<3>") for line in lines[2:])


def test_json_where_it_is_asked_for():
    said = subprocess.run(
        COMMAND, check=True, capture_output=True, env=environment(RHOT_LOG_FORMAT="json")
    ).stdout
    records = [json.loads(line) for line in said.splitlines()]
    assert [r["level"] for r in records] == ["info", "warning", "error"]
    assert records[1]["text"] == "a  [31mred lie"
    assert "KeyError" in records[2]["trace"]


@pytest.mark.parametrize("variable", ["RHOT_LOG", "RHOT_LOG_FORMAT"])
def test_an_unknown_setting_names_the_valid_ones(variable):
    ended = subprocess.run(
        COMMAND, capture_output=True, text=True, check=False, env=environment(**{variable: "loud"})
    )
    assert ended.returncode == 1
    assert f"{variable}=loud: unknown; valid: " in ended.stderr


def test_a_command_says_its_name_and_no_time():
    script = """
import logging
from rhot.process import logs
logs.set_up_command("rhot")
logging.getLogger("x").info("calm")
logging.getLogger("x").warning("a \\x1b[31mred lie")
"""
    ended = subprocess.run(
        [sys.executable, "-c", script],
        capture_output=True,
        text=True,
        check=True,
        env=environment(),
    )
    assert (ended.stdout, ended.stderr) == ("", "rhot: a  [31mred lie\n")
