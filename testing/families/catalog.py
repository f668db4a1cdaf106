"""Every case of every family. Pure data."""

from __future__ import annotations

from testing.families.case import CaseSpec, Half, Kind
from testing.families.picture_catalog import picture_cases
from testing.families.point_catalog import point_cases

_CASES = point_cases() + picture_cases()
FAMILIES = tuple(dict.fromkeys(spec.family for spec in _CASES))


def cases(half: Half, kind: Kind, family: str | None = None) -> list[CaseSpec]:
    """The cases of a half, of one family or of all."""
    return [
        spec
        for spec in _CASES
        if (spec.half, spec.kind) == (half, kind) and family in (None, spec.family)
    ]
