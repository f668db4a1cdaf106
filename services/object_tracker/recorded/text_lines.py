"""The lines of a text file, plain or gzipped, with their numbers. Pure.

A gzip file is known by its first bytes, not by its name. Lines end with LF, CR LF or CR alone: a
console log of triad_openvr overwrites its line with carriage returns.
"""

from __future__ import annotations

import gzip
import io
import zlib
from collections.abc import Iterator
from pathlib import Path

from rhot.errors import CaptureError

_GZIP = b"\x1f\x8b"
# A CONFIG line of libsurvive, the longest line there is, has some 20 kB.
LONGEST_LINE = 1 << 20


def text_lines(path: Path) -> Iterator[tuple[int, str]]:
    """Each line without its end, counted from 1; bytes that are no UTF-8 become U+FFFD.

    Raises CaptureError for a file that cannot be read, is cut off inside gzip, or has a line longer
    than LONGEST_LINE.
    """
    number = 0
    try:
        with path.open("rb") as raw:
            packed = raw.read(len(_GZIP)) == _GZIP
            raw.seek(0)
            # Both are binary streams; newline=None in the wrapper makes every line's end an LF.
            stream = gzip.GzipFile(fileobj=raw) if packed else raw
            with io.TextIOWrapper(stream, "utf-8", "replace", newline=None) as text:
                while line := text.readline(LONGEST_LINE):
                    number += 1
                    if len(line) == LONGEST_LINE:
                        raise CaptureError(
                            f"{path}: line {number}: longer than {LONGEST_LINE} characters:"
                            " this is no text recording of poses"
                        )
                    yield number, line.removesuffix("\n")
    except EOFError:
        raise CaptureError(
            f"{path}: ends inside its compressed data after line {number}; copy it again, or"
            " `zcat` what is left into a new file"
        ) from None
    except (OSError, zlib.error) as error:
        raise CaptureError(f"{path}: cannot be read after line {number}: {error}") from None
