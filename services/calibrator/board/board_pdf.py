"""A board as a PDF of exact size: black squares as vectors, nothing a printer could resample. Pure:
bytes out, the same every time.

Written by hand, as a page of filled rectangles needs five objects (ISO 32000-1, sections 7.5 and
8.5). A ruler of 100 mm lets the user check that the printer did not scale. A board that does not
fit on the paper is a CalibrationError that says what would.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from rhot.errors import CalibrationError
from services.calibrator.board.board import Board
from services.calibrator.board.detect import charuco_board

PAPERS_MM = {
    "a4": (210.0, 297.0),
    "letter": (215.9, 279.4),
    "a3": (297.0, 420.0),
    "a2": (420.0, 594.0),
    "a1": (594.0, 841.0),
    "a0": (841.0, 1189.0),
}
# 1 pt is 1/72 inch.
_PT = 72.0 / 25.4
# Printers leave 4 to 5 mm unprinted; detectors want a white margin about as wide as half a square,
# which the paper adds.
_MARGIN_MM = 6.0
# Room for the ruler and the line of text below the board.
_FOOT_MM = 16.0
_RULER_MM = 100.0
Rectangle = tuple[float, float, float, float]


def board_pdf(board: Board, paper: str = "a4") -> bytes:
    """The page with the board: x, y of its squares in mm from its top left corner, centred, turned
    to fit.

    Raises CalibrationError if the paper is unknown, or too small.
    """
    if paper not in PAPERS_MM:
        raise CalibrationError(f"paper {paper!r} is not known; use one of {', '.join(PAPERS_MM)}")
    side_mm = 1e3 * board.square_m
    size = ((board.cols + 1) * side_mm, (board.rows + 1) * side_mm)
    page = _page(board, size, paper)
    left, top = (page[0] - size[0]) / 2.0, max(_MARGIN_MM, (page[1] - _FOOT_MM - size[1]) / 2.0)
    content = ["0 g"]
    content += [_rectangle(page, left + x, top + y, w, h) for x, y, w, h in rectangles(board)]
    content.append("f")
    content += _foot(page, board)
    return _document(page, "\n".join(content).encode("latin-1"))


def rectangles(board: Board) -> Iterator[Rectangle]:
    """What is black, as x, y, width, height in mm from the board's top left corner, y down."""
    side = 1e3 * board.square_m
    if board.kind == "charuco":
        yield from _charuco(board, side)
        return
    for row in range(board.rows + 1):
        for col in range(board.cols + 1):
            if (row + col) % 2 == 0:
                yield col * side, row * side, side, side


def _charuco(board: Board, side: float) -> Iterator[Rectangle]:
    made = charuco_board(board)
    marker_mm = board.marker * side
    corners = [
        1e3 * np.asarray(points, dtype=np.float64).reshape(-1, 3)[:, :2].min(axis=0)
        for points in made.getObjPoints()
    ]
    white = {
        (int(y // side), int(x // side))
        for x, y in (corner + 0.5 * marker_mm for corner in corners)
    }
    for row in range(board.rows + 1):
        for col in range(board.cols + 1):
            if (row, col) not in white:
                yield col * side, row * side, side, side
    dictionary = made.getDictionary()
    cells = dictionary.markerSize + 2
    for number, (x, y) in zip(np.asarray(made.getIds()).reshape(-1), corners, strict=True):
        picture = np.asarray(dictionary.generateImageMarker(int(number), cells))
        step = marker_mm / cells
        for row in range(cells):
            for begin, end in _runs(picture[row] == 0):
                yield x + begin * step, y + row * step, (end - begin) * step, step


def _runs(black: np.ndarray) -> Iterator[tuple[int, int]]:
    """Begin and end of every run of True.

    One rectangle for a run leaves no hairline between its cells.
    """
    edges = np.flatnonzero(np.diff(np.concatenate([[0], black.astype(np.int8), [0]])))
    yield from ((int(begin), int(end)) for begin, end in edges.reshape(-1, 2))


def _page(board: Board, size: tuple[float, float], paper: str) -> tuple[float, float]:
    width, height = PAPERS_MM[paper]
    for page in ((width, height), (height, width)):
        if size[0] + 2 * _MARGIN_MM <= page[0] and size[1] + _MARGIN_MM + _FOOT_MM <= page[1]:
            return page
    largest = max(
        min(
            (page[0] - 2 * _MARGIN_MM) / (board.cols + 1),
            (page[1] - _MARGIN_MM - _FOOT_MM) / (board.rows + 1),
        )
        for page in ((width, height), (height, width))
    )
    raise CalibrationError(
        f"a {board.name} board is {size[0]:g}x{size[1]:g} mm and does not fit on {paper}; "
        f"squares of {np.floor(2.0 * largest) / 2.0:g} mm do, or larger paper ({', '.join(PAPERS_MM)})"
    )


def _rectangle(page: tuple[float, float], x: float, y: float, width: float, height: float) -> str:
    return (
        f"{x * _PT:.4f} {(page[1] - y - height) * _PT:.4f} {width * _PT:.4f} {height * _PT:.4f} re"
    )


def _foot(page: tuple[float, float], board: Board) -> list[str]:
    """The ruler, with a tick each 10 mm, and one line that says what the board is."""
    left, bottom = (page[0] - _RULER_MM) / 2.0, 10.0
    lines = [
        "0.3 w",
        f"{left * _PT:.4f} {bottom * _PT:.4f} m {(left + _RULER_MM) * _PT:.4f} {bottom * _PT:.4f} l",
    ]
    for tick in range(11):
        x, length = left + 10.0 * tick, 3.0 if tick % 5 == 0 else 1.5
        lines.append(
            f"{x * _PT:.4f} {bottom * _PT:.4f} m {x * _PT:.4f} {(bottom + length) * _PT:.4f} l"
        )
    text = f"100 mm  -  print at 100 %, then measure this line  -  {_described(board)}"
    # Helvetica's characters are half as wide as high, on average: close enough to centre a line.
    start = page[0] / 2.0 - 0.25 * len(text) * 8.0 / _PT
    return [
        *lines,
        "S",
        f"BT /F1 8 Tf {start * _PT:.3f} {(bottom - 4.0) * _PT:.3f} Td ({text}) Tj ET",
    ]


def _described(board: Board) -> str:
    text = f"{board.kind} --board {board.cols}x{board.rows} --square {board.square_m:g}"
    return (
        text + f" --marker {board.marker:g} --dictionary {board.dictionary}"
        if board.kind == "charuco"
        else text
    )


def _document(page: tuple[float, float], content: bytes) -> bytes:
    objects = [
        b"<< /Type /Catalog /Pages 2 0 R >>",
        b"<< /Type /Pages /Kids [3 0 R] /Count 1 >>",
        f"<< /Type /Page /Parent 2 0 R /MediaBox [0 0 {page[0] * _PT:.4f} {page[1] * _PT:.4f}] /Contents 4 0 R "
        "/Resources << /Font << /F1 5 0 R >> >> >>".encode(),
        b"<< /Length %d >>\nstream\n%s\nendstream" % (len(content), content),
        b"<< /Type /Font /Subtype /Type1 /BaseFont /Helvetica >>",
    ]
    # PrintScaling None asks viewers to leave the size alone.
    objects[0] = b"<< /Type /Catalog /Pages 2 0 R /ViewerPreferences << /PrintScaling /None >> >>"
    document, places = b"%PDF-1.6\n", []
    for number, body in enumerate(objects, start=1):
        places.append(len(document))
        document += b"%d 0 obj\n%s\nendobj\n" % (number, body)
    table = b"".join(b"%010d 00000 n \n" % place for place in places)
    start = len(document)
    document += b"xref\n0 %d\n0000000000 65535 f \n%s" % (len(objects) + 1, table)
    return document + b"trailer\n<< /Size %d /Root 1 0 R >>\nstartxref\n%d\n%%%%EOF\n" % (
        len(objects) + 1,
        start,
    )
