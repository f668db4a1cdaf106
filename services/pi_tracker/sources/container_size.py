"""How long a video file says that it is, read from its container: is the end of it missing?

A file that was cut short still opens: its header announces more than there is. How many frames come
out of it does not tell, as a trimmed video holds frames that are not to be shown (an edit list of
mp4). Containers are read as written down: ISO/IEC 14496-12 section 4.2 (mp4, mov), RFC 8794 section
6 and RFC 9559 (Matroska, WebM), RIFF (AVI).
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import BinaryIO

# EBML's own header and Matroska's Segment, which holds all the rest.
_EBML, _SEGMENT = 0x1A45DFA3, 0x18538067
# Boxes that an mp4 or mov begins with.
_FIRST_BOXES = {b"ftyp", b"moov", b"mdat", b"free", b"skip", b"wide", b"styp"}


def announced_size(path: Path) -> int | None:
    """Bytes that the container says the file has; None of an unknown one, or if it does not say.

    Raises OSError if the file cannot be read.
    """
    with path.open("rb") as file:
        head = file.read(12)
        file.seek(0)
        if head[4:8] in _FIRST_BOXES:
            return _boxes_end(file)
        if head[:4] == _EBML.to_bytes(4, "big"):
            return _segment_end(file)
        if head[:4] == b"RIFF":
            return _riff_end(file)
    return None


def _boxes_end(file: BinaryIO) -> int | None:
    """The end of the last box of an mp4; boxes follow each other, each begins with its size."""
    size = os.fstat(file.fileno()).st_size
    end = 0
    while end < size:
        file.seek(end)
        head = file.read(16)
        length = int.from_bytes(head[:4], "big")
        if length == 1 and len(head) == 16:
            length = int.from_bytes(head[8:], "big")
        if length == 0 and len(head) >= 8:
            # Up to the end of the file, wherever that is.
            return None
        if length < 8:
            # The box's head itself is cut off, or there is something else behind the last one.
            return end + 8 if len(head) < 8 else end
        end += length
    return end


def _segment_end(file: BinaryIO) -> int | None:
    """The end of a Matroska file's segment; None of a recording that never learnt its length."""
    while (number := _element_id(file)) is not None:
        length = _element_length(file)
        if length is None:
            return None
        end = file.tell() + length
        if number == _SEGMENT:
            return end
        file.seek(end)
    return None


def _element_id(file: BinaryIO) -> int | None:
    first = file.read(1)
    if not first or first[0] == 0:
        return None
    return int.from_bytes(first + file.read(8 - first[0].bit_length()), "big")


def _element_length(file: BinaryIO) -> int | None:
    """An element's length; None if it is unknown: all bits set, as of a stream."""
    first = file.read(1)
    if not first or first[0] == 0:
        return None
    more = 8 - first[0].bit_length()
    bits = 7 * (more + 1)
    value = int.from_bytes(first + file.read(more), "big") & ((1 << bits) - 1)
    return None if value == (1 << bits) - 1 else value


def _riff_end(file: BinaryIO) -> int:
    """The end of an AVI's last RIFF chunk: one a gigabyte, each begins with its size."""
    size = os.fstat(file.fileno()).st_size
    end = 0
    while end < size:
        file.seek(end)
        head = file.read(8)
        if head[:4] != b"RIFF":
            break
        length = int.from_bytes(head[4:8], "little")
        end += 8 + length + length % 2
    return end
