"""The report of a folder: figures, tables and pages, written beside each other."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import msgspec

from studies.grasp.recover.errors import errors_of
from studies.grasp.report import contents
from studies.grasp.report.angle_figures import angles_figure, iterations_figure, people_figure
from studies.grasp.report.law_figures import laws_figure
from studies.grasp.report.motion_range import person_range
from studies.grasp.report.pages import Picture, Report, Section, written_report
from studies.grasp.report.path_figures import paths_figure
from studies.grasp.report.study import Person, load_study, same_length
from studies.grasp.report.style import Drawn
from studies.grasp.report.tables import Table

# People in one figure with a panel each.
_PANELS = 6
_KINDS = ("angles", "paths", "laws", "people", "effort")


def write_report(
    folder: Path, out: Path, title: str, about: str, begun: Callable[[int], Callable[[], None]]
) -> list[Path]:
    """Write everything; the files written, the HTML first.

    begun is told how many figures there will be, and gives what is called after each. Raises
    CaptureError.
    """
    people = load_study(folder)
    left_out = folder / "left_out.txt"
    missing = left_out.read_text().splitlines() if left_out.is_file() else []
    groups = [people[k : k + _PANELS] for k in range(0, len(people), _PANELS)]
    advance = begun(len(people) + 2 * len(groups) + 2)
    pictures: dict[str, list[Picture]] = {
        kind: [] for kind in ("angles", "paths", "laws", "people", "effort")
    }
    for kind, drawn in _figures(people, groups):
        if drawn is not None:
            pictures[kind].append(drawn.picture())
        advance()
    report = Report(title, about, _sections(people, pictures, missing), _notes(people))
    numbers = msgspec.json.encode(_figures_of(people))
    files = [contents.all_errors_table(people), contents.angles_table(people)]
    return written_report(report, out, "report", numbers, files)


def _figures(
    people: Sequence[Person], groups: Sequence[Sequence[Person]]
) -> Iterator[tuple[str, Drawn | None]]:
    for number, person in enumerate(people, start=1):
        yield "angles", angles_figure(person, number)
    for number, group in enumerate(groups, start=1):
        yield "paths", paths_figure(group, number)
        yield "laws", laws_figure(group, number)
    alike = same_length(list(people))
    yield "people", people_figure(people) if alike else None
    yield "effort", iterations_figure(people) if alike else None


def _sections(
    people: Sequence[Person], pictures: dict[str, list[Picture]], missing: Sequence[str]
) -> list[Section]:
    errors = contents.error_table(people, "fixed", "Errors, fixed lengths")
    measured = contents.error_table(people, "measured", "Errors, lengths of each frame")
    by_person = contents.person_error_table(people)
    laws = contents.law_table(people)
    found: list[tuple[str, str, list[Table | Picture | None]]] = [
        ("Recordings", _left_out(missing), [contents.people_table(people)]),
        ("Range of motion", "", [contents.motion_table(people), *pictures["people"]]),
        ("Joint angles", "", [contents.method_table(), *pictures["angles"]]),
        ("Errors", "", [errors, measured, by_person if by_person.rows else None]),
        ("Iterations", "", [contents.effort_table(people), *pictures["effort"]]),
        ("Paths of the tip", "", [*pictures["paths"]]),
        ("DIP and PIP", "", [laws if laws.rows else None, *pictures["laws"]]),
    ]
    return [
        Section(title, text, kept)
        for title, text, parts in found
        if (kept := [one for one in parts if one is not None])
    ]


def _left_out(missing: Sequence[str]) -> str:
    return f"Left out: {'; '.join(missing)}." if missing else ""


def _notes(people: Sequence[Person]) -> dict[str, list[str]]:
    notes: dict[str, list[str]] = {}
    for entry in (entry for person in people for entry in person.entries):
        own = [*entry.recovery.notes, *(f"left out: {one}" for one in entry.recovery.incomplete)]
        for one in entry.recovery.sequences:
            if one.note and one.note not in own:
                own.append(f"{one.kind} {one.number}: {one.note}")
        if own:
            notes[entry.name] = own
    return notes


def _figures_of(people: Sequence[Person]) -> dict[str, object]:
    """What tables say, as numbers for other programs."""
    everybody = errors_of([entry.recovery for person in people for entry in person.entries])
    return {
        "errors": everybody,
        "people": [
            {
                "subject": person.subject,
                "finger": person.finger,
                "errors": errors_of([entry.recovery for entry in person.entries]),
                "law": person.entries[0].recovery.law,
                "range_of_motion_deg": person_range(person),
            }
            for person in people
        ],
    }
