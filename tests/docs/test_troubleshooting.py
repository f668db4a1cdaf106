"""docs/guide/troubleshooting.md has a section for every fault, and for nothing else."""

from __future__ import annotations

import re

import pytest

from rhot.faults import FAULTS


@pytest.fixture(scope="module")
def sections(repository):
    text = (repository / "docs" / "guide" / "troubleshooting.md").read_text(encoding="utf-8")
    found = re.findall(r"^### (\S+)\n(.*?)(?=^#{2,3} |\Z)", text, re.MULTILINE | re.DOTALL)
    return dict(found)


def test_no_code_without_section_and_no_section_without_code(sections):
    assert set(sections) == set(FAULTS)


@pytest.mark.parametrize("code", FAULTS)
def test_a_section_says_what_one_sees_why_and_what_to_do(sections, code):
    said = sections[code]
    assert [word for word in ("You see:", "Why:", "Do:") if f"\n{word} " in f"\n{said}"] == [
        "You see:",
        "Why:",
        "Do:",
    ]
