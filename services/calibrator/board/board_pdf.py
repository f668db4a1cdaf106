"""A board as a PDF of exact size: black squares as vectors, nothing a printer could resample. Pure.

Bytes come out, the same every time. They are written by hand, as a page of filled rectangles needs
five objects (ISO 32000-1, sections 7.5 and 8.5). A ruler of 100 mm lets the user check that the
printer did not scale. A board that does not fit on the paper is a CalibrationError that says what
would.
"""

from __future__ import annotations

import numpy as np

from rhot.errors import CalibrationError
from services.calibrator.board.board import Board
from services.calibrator.board.board_pattern import Rectangle, black_rectangles, pattern_size_mm

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
_RULER_BOTTOM_MM = 10.0
# Width and height of the page in mm.
Page = tuple[float, float]


def board_pdf(board: Board, paper: str = "a4") -> bytes:
    """A page with the board in its middle, turned to fit, and a ruler below.

    Raises CalibrationError if the paper is unknown, or too small.
    """
    if paper not in PAPERS_MM:
        raise CalibrationError(f"paper {paper!r} is not known; use one of {', '.join(PAPERS_MM)}")
    width, height = pattern_size_mm(board)
    page = _fitting_page(board, paper)
    left = (page[0] - width) / 2.0
    top = max(_MARGIN_MM, (page[1] - _FOOT_MM - height) / 2.0)
    content = ["0 g"]
    content += [_rectangle(page, left, top, black) for black in black_rectangles(board)]
    content.append("f")
    content += _foot(page, board)
    return _document(page, "\n".join(content).encode("latin-1"))


def _fitting_page(board: Board, paper: str) -> Page:
    """The paper upright or on its side, whichever holds the board."""
    width, height = pattern_size_mm(board)
    pages = (PAPERS_MM[paper], PAPERS_MM[paper][::-1])
    for page in pages:
        if width + 2 * _MARGIN_MM <= page[0] and height + _MARGIN_MM + _FOOT_MM <= page[1]:
            return page
    largest = max(
        min(
            (page[0] - 2 * _MARGIN_MM) / (board.cols + 1),
            (page[1] - _MARGIN_MM - _FOOT_MM) / (board.rows + 1),
        )
        for page in pages
    )
    raise CalibrationError(
        f"a {board.name} board is {width:g}x{height:g} mm and does not fit on {paper}; squares of "
        f"{np.floor(2.0 * largest) / 2.0:g} mm do, or larger paper ({', '.join(PAPERS_MM)})"
    )


def _rectangle(page: Page, left: float, top: float, black: Rectangle) -> str:
    """The PDF operator of a rectangle of a board whose top left corner is at left, top."""
    x, y = left + black.x, top + black.y
    return (
        f"{x * _PT:.4f} {(page[1] - y - black.height) * _PT:.4f} "
        f"{black.width * _PT:.4f} {black.height * _PT:.4f} re"
    )


def _foot(page: Page, board: Board) -> list[str]:
    """The ruler, with a tick each 10 mm, and one line that says what the board is."""
    left, bottom = (page[0] - _RULER_MM) / 2.0, _RULER_BOTTOM_MM
    lines = ["0.3 w", _line(left, bottom, left + _RULER_MM, bottom)]
    for tick in range(11):
        x, length = left + 10.0 * tick, 3.0 if tick % 5 == 0 else 1.5
        lines.append(_line(x, bottom, x, bottom + length))
    text = f"100 mm  -  print at 100 %, then measure this line  -  {_description(board)}"
    # Helvetica's characters are half as wide as high, on average: close enough to centre a line.
    start = page[0] / 2.0 - 0.25 * len(text) * 8.0 / _PT
    return [
        *lines,
        "S",
        f"BT /F1 8 Tf {start * _PT:.3f} {(bottom - 4.0) * _PT:.3f} Td ({text}) Tj ET",
    ]


def _line(x0: float, y0: float, x1: float, y1: float) -> str:
    """The PDF operators of a line, mm from the page's bottom left corner."""
    return f"{x0 * _PT:.4f} {y0 * _PT:.4f} m {x1 * _PT:.4f} {y1 * _PT:.4f} l"


def _description(board: Board) -> str:
    """The options with which `rhot calibrate` is told of the board."""
    text = f"{board.kind} --board {board.cols}x{board.rows} --square {board.square_m:g}"
    if board.kind == "charuco":
        text += f" --marker {board.marker:g} --dictionary {board.dictionary}"
    return text


def _document(page: Page, content: bytes) -> bytes:
    box = f"[0 0 {page[0] * _PT:.4f} {page[1] * _PT:.4f}]"
    objects = [
        # PrintScaling None asks viewers to leave the size alone.
        b"<< /Type /Catalog /Pages 2 0 R /ViewerPreferences << /PrintScaling /None >> >>",
        b"<< /Type /Pages /Kids [3 0 R] /Count 1 >>",
        f"<< /Type /Page /Parent 2 0 R /MediaBox {box} /Contents 4 0 R "
        "/Resources << /Font << /F1 5 0 R >> >> >>".encode(),
        b"<< /Length %d >>\nstream\n%s\nendstream" % (len(content), content),
        b"<< /Type /Font /Subtype /Type1 /BaseFont /Helvetica >>",
    ]
    document, offsets = b"%PDF-1.6\n", []
    for number, body in enumerate(objects, start=1):
        offsets.append(len(document))
        document += b"%d 0 obj\n%s\nendobj\n" % (number, body)
    table = b"".join(b"%010d 00000 n \n" % offset for offset in offsets)
    start = len(document)
    document += b"xref\n0 %d\n0000000000 65535 f \n%s" % (len(objects) + 1, table)
    return document + b"trailer\n<< /Size %d /Root 1 0 R >>\nstartxref\n%d\n%%%%EOF\n" % (
        len(objects) + 1,
        start,
    )
