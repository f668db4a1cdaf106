"""Numbers in a text, byte for byte as msgspec writes them."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest

from services.solver.number_text import Template, filled


def template(decimals: list[int]) -> Template:
    """A list in JSON, with a gap for each number."""
    pieces = ["[", *[","] * (len(decimals) - 1), "]"]
    return Template(
        np.frombuffer("".join(pieces).encode(), dtype=np.uint8).copy(),
        np.arange(1, len(pieces) + 1),
        np.arange(len(decimals)),
        np.array(decimals),
    )


def text(values: list[float], decimals: int) -> bytes:
    return filled(template([decimals] * len(values)), np.array(values)).tobytes()


@pytest.mark.parametrize("decimals", [1, 6, 13])
def test_decimals_are_what_msgspec_writes(decimals: int) -> None:
    rng = np.random.default_rng(1)
    whole = rng.integers(-(10 ** rng.integers(1, 15, 2000)), 10 ** rng.integers(1, 15, 2000))
    values = (whole / 10.0**decimals).tolist()
    for value in values:
        assert text([value], decimals) == msgspec.json.encode([value])


def test_small_round_and_negative_numbers() -> None:
    values = [0.0, -0.0, 1e-6, -9e-6, 1e-5, 1.1e-5, 0.1, -0.000123, 12.0, 100.5, -3.141593, 1e8]
    assert text(values, 6) == msgspec.json.encode(values)
    assert text([1.5e-12, 3e-10, -1.629159e-7], 13) == msgspec.json.encode(
        [1.5e-12, 3e-10, -1.629159e-7]
    )


def test_whole_numbers_have_no_point() -> None:
    assert text([0.0, 7.0, 60.0, 1234567890.0], -1) == b"[0,7,60,1234567890]"


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1.0 / 3.0, 1e-7, 1e15])
def test_what_has_no_exact_text_gives_none(value: float) -> None:
    assert text([0.5, value], 6) == b""


def test_numbers_may_stand_in_several_places() -> None:
    twice = template([2, -1, 2])._replace(slots=np.array([1, 0, 1]))
    assert filled(twice, np.array([3.0, 0.25])).tobytes() == b"[0.25,3,0.25]"
