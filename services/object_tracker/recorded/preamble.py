"""What stands before the first row of a table of poses. Pure."""

from __future__ import annotations

import calendar
import re
from dataclasses import dataclass

from services.object_tracker.recorded.columns import Columns, columns_of_header, columns_of_row

_SEPARATORS = re.compile(r"\s*[,;\t]\s*|\s+")
_COMMAS = re.compile(r"[,;\t]")
_AROUND = str.maketrans('[]()"', "     ")
_FREQUENCY = re.compile(r"\bFreq: *([0-9]{1,5}(?:\.[0-9]{1,5})?)")
_BEGAN = re.compile(r"\bcurrent Time: *(\d{4})-(\d\d)-(\d\d)[-T ](\d\d):(\d\d):(\d\d)")
# A column's unit in brackets: `x [mm]`.
_UNIT = re.compile(r"\s*[\[(](\w{1,2})[\])]")
# What triad_openvr's print_discovered_objects says of a tracker; its scripts read tracker_1.
_TRACKER = re.compile(r"\s*tracker_1 \(([A-Za-z0-9][A-Za-z0-9_.-]{0,63}),")
# triad_openvr's own scripts sample at 250 Hz.
_DEFAULT_HZ = 250.0


@dataclass
class Preamble:
    """What is known of a table's rows: the columns of each device (none: not yet), their rate, when
    they began, the device where they name none.
    """

    serial: str
    columns: tuple[Columns, ...] = ()
    rate_hz: float = _DEFAULT_HZ
    began_s: float = 0.0

    def read(self, line: str) -> bool:
        """Takes one line more; whether it is the first row already."""
        if tracker := _TRACKER.match(line):
            self.serial = tracker[1]
        if (rate := _FREQUENCY.search(line)) and float(rate[1]) > 0.0:
            self.rate_hz = float(rate[1])
        if began := _BEGAN.search(line):
            self.began_s = float(calendar.timegm(tuple(map(int, began.groups()))))
        comment = line.lstrip().startswith("#")
        names = line.lstrip("# \t").partition(" Freq:")[0]
        words = words_of(names)
        words = words[:-1] if words[-1] == "" else words
        numbers = [number_of(word) for word in row_words(words)]
        if numbers and not comment and None not in numbers:
            self.columns = columns_of_row([number for number in numbers if number is not None])
            return bool(self.columns)
        names = _UNIT.sub(r"_\1", names)
        # Where commas part them, names may have spaces.
        parts = _COMMAS.split(names) if _COMMAS.search(names) else words_of(names)
        self.columns = columns_of_header(parts)
        return False


def words_of(line: str) -> list[str]:
    """The words of a line; commas, semicolons, brackets and white space part them.

    Between two commas with nothing between them is an empty word.
    """
    return _SEPARATORS.split(line.translate(_AROUND).strip())


def row_words(words: list[str]) -> list[str]:
    """The words of a row without what stands before its first number, as in `trackerPose: ...`."""
    first = next((i for i, word in enumerate(words) if number_of(word) is not None), len(words))
    return words[first:]


def number_of(word: str) -> float | None:
    """A word as a number (nan and inf are some too), None if it is none."""
    try:
        return float(word)
    except ValueError:
        return None
