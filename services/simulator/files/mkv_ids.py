"""Gives a Matroska file fixed identifiers, so that the same pictures make the same bytes.

FFmpeg writes a random SegmentUID and TrackUID into every file, and OpenCV cannot stop it. They are
in the Info, Tracks and Tags elements at the head of the file, each protected by a CRC-32. A file
built in another way is left as it is: it plays all the same. RFC 9559 (Matroska) and RFC 8794
(EBML).
"""

from __future__ import annotations

import zlib
from collections.abc import Iterator
from pathlib import Path

_CRC32, _CLUSTER = 0xBF, 0x1F43B675
# SegmentUID, TrackUID, TagTrackUID.
_IDENTIFIERS = (0x73A4, 0x73C5, 0x63C5)
_SEGMENT = 0x18538067
# Elements that hold these: Segment, Info, Tracks, Tags, Tag, Targets, TrackEntry.
_MASTERS = (_SEGMENT, 0x1549A966, 0x1654AE6B, 0x1254C367, 0x7373, 0x63C0, 0xAE)
# The header of a file with one video track has under 1 kB.
_HEAD = 65536


def fix_identifiers(path: Path, number: int) -> None:
    """Replace the random identifiers of a finished file by `number`, checksums included."""
    with path.open("r+b") as file:
        head = bytearray(file.read(_HEAD))
        try:
            _fix_elements(head, 0, len(head), number)
        except IndexError:
            # Not the layout that is known here.
            return
        file.seek(0)
        file.write(head)


def is_cut_off(path: Path) -> bool:
    """Whether a finished file is shorter than its head says: the end did not fit on the disk."""
    with path.open("rb") as file:
        head = bytearray(file.read(_HEAD))
    at, size = 0, path.stat().st_size
    try:
        while at < size:
            identifier, at = _read_number(head, at, keep_marker=True)
            length, at = _read_number(head, at, keep_marker=False)
            at += length
            if identifier == _SEGMENT:
                return at > size
    except IndexError:
        pass
    # Not even the head is whole.
    return True


def _elements(data: bytearray, start: int, end: int) -> Iterator[tuple[int, int, int]]:
    """(id, first byte, end) of the content of each element in data[start:end]."""
    while start < end:
        identifier, start = _read_number(data, start, keep_marker=True)
        size, start = _read_number(data, start, keep_marker=False)
        yield identifier, start, min(start + size, len(data))
        start += size


def _read_number(data: bytearray, at: int, *, keep_marker: bool) -> tuple[int, int]:
    """An EBML number of variable length, and where it ends."""
    first = data[at]
    length = 9 - first.bit_length()
    if length > 8:
        raise IndexError("no EBML number")
    value = first if keep_marker else first & ((1 << (8 - length)) - 1)
    for byte in data[at + 1 : at + length]:
        value = value << 8 | byte
    return value, at + length


def _fix_elements(data: bytearray, start: int, end: int, number: int) -> None:
    """Replace identifiers and checksums in data[start:end], and in the elements inside it."""
    checksum = -1
    for identifier, first, last in _elements(data, start, end):
        if identifier == _CLUSTER:
            return
        if identifier == _CRC32:
            checksum = first
        elif identifier in _IDENTIFIERS:
            data[first:last] = number.to_bytes(last - first, "big")
        elif identifier in _MASTERS:
            _fix_elements(data, first, last, number)
    if checksum >= 0 and end <= len(data):
        # The checksum covers everything after itself.
        data[checksum : checksum + 4] = zlib.crc32(data[checksum + 4 : end]).to_bytes(4, "little")
