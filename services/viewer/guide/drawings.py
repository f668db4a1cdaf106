"""Small pictures of what to do, as SVG: lines in the colour of the text, and nothing else. Pure."""

from __future__ import annotations


def _svg(content: str) -> str:
    return (
        '<svg viewBox="0 0 220 84" style="width:100%;max-width:220px;display:block;margin:0.3em 0" '
        'fill="none" stroke="currentColor" stroke-width="2" stroke-linejoin="round" '
        f'stroke-linecap="round" aria-hidden="true">{content}</svg>'
    )


def _camera(x: int, y: int) -> str:
    """A camera that looks down, its lens at the bottom."""
    return (
        f'<rect x="{x - 14}" y="{y}" width="28" height="16" rx="3"/>'
        f'<path d="M{x - 6} {y + 16} l-4 7 h20 l-4 -7"/>'
    )


def _hand(x: int, y: int) -> str:
    """A palm with five fingers, a dab of paint on each tip."""
    fingers = ((-24, 16, 6), (-12, -6, 14), (-2, -10, 16), (8, -7, 14), (18, -1, 10))
    lines = "".join(
        f'<path d="M{x + int(dx * 0.6)} {y + 26} L{x + dx} {y + dy}"/>'
        f'<circle cx="{x + dx}" cy="{y + dy}" r="3.5" fill="#0072b2" stroke="none"/>'
        for dx, dy, _ in fingers
    )
    return f'{lines}<path d="M{x - 16} {y + 26} q16 30 30 0"/>'


def _board(x: int, y: int, skew: int) -> str:
    """A chessboard, tilted by so much."""
    cells = []
    for row in range(3):
        for column in range(4):
            if (row + column) % 2 == 0:
                left, top = x + 11 * column, y + 11 * row + skew * column // 4
                cells.append(
                    f'<path d="M{left} {top} l11 {skew // 4} v11 l-11 {-skew // 4} z" '
                    'fill="currentColor" stroke="none"/>'
                )
    outline = f'<path d="M{x} {y} l44 {skew} v33 l-44 {-skew} z"/>'
    return outline + "".join(cells)


_RAYS = '<path d="M76 30 L98 50 M144 30 L122 50" stroke-dasharray="3 4"/>'
CAMERA = _svg(
    _camera(110, 2)
    + _hand(110, 48)
    + '<circle cx="36" cy="22" r="9"/><path d="M36 5 v4 M36 35 v4 M19 22 h4 M49 22 h4 M24 10 l3 3 '
    'M45 31 l3 3 M24 34 l3 -3 M45 13 l3 -3"/>'
)
COLOURS = _svg(_hand(110, 34) + '<path d="M140 26 l12 26 5 -10 11 -2 z" fill="currentColor"/>')
BOARD = _svg(_camera(110, 0) + _board(20, 34, 8) + _board(88, 46, 0) + _board(156, 42, -8))
STEREO = _svg(_camera(70, 2) + _camera(150, 2) + _RAYS + _board(88, 48, 4))
HAND = _svg(_camera(70, 0) + _camera(150, 0) + _RAYS + _hand(110, 50))
OBJECTS = _svg(
    _camera(70, 0)
    + _camera(150, 0)
    + '<circle cx="110" cy="54" r="15"/><circle cx="110" cy="54" r="4" fill="#0072b2" '
    'stroke="none"/><path d="M80 62 q-16 10 -34 2 M46 64 l6 -4 M46 64 l6 5 M140 62 q16 10 34 2 '
    'M174 64 l-6 -4 M174 64 l-6 5"/>'
)
