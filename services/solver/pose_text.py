"""A pose as JSON, straight from its numbers: byte for byte what msgspec makes of the message.

A message of 26 joints is a hundred objects that are made, read once and thrown away. Here the text
of a message with other numbers is the template, one for each set of measured landmarks and
outcomes, of which a recording has a few.
"""

from __future__ import annotations

import re
from collections.abc import Callable

import msgspec
import numpy as np

from rhot.geometry.transforms import Array
from rhot.hand import DIGITS
from rhot.messages import HandPoints, HandPose
from services.solver.number_text import Template, filled
from services.solver.pose_numbers import DECIMALS, DIGIT_ROWS, OUTCOME

# Templates that are remembered: of some kB each.
_MAX_TEMPLATES = 64
# Numbers that stand for others in a template: unlike any radius, each once.
_FIRST = 100_000.5
_GAP = re.compile(rb"(?<=[\[:,])1\d{5}(\.5)?(?=[,\]}]|$)")
_SENT = b',"sent_ns":0}'
_THUMB_CMC = (DIGIT_ROWS.start + DIGITS.index("thumb"), 1)


class PoseTexts:
    """One hand's poses as JSON."""

    def __init__(self) -> None:
        self._templates: dict[tuple[object, bytes], Template] = {}

    def of(
        self, points: HandPoints, numbers: Array, kind: object, message: Callable[[Array], HandPose]
    ) -> bytes:
        """The pose but for its end, sent_ns: see Publisher.put_text.

        numbers (32, 8) as in pose_numbers.py; message makes the pose of such numbers, kind is what
        else that depends on.
        """
        key = kind, numbers[DIGIT_ROWS, OUTCOME].tobytes()
        template = self._templates.get(key)
        if template is None:
            template = _template(message, numbers[DIGIT_ROWS, OUTCOME])
            if len(self._templates) < _MAX_TEMPLATES:
                self._templates[key] = template
        # The field is left out where it is 0.
        body = b"" if numbers[_THUMB_CMC] == 0.0 else filled(template, numbers.ravel()).tobytes()
        if not body:
            return msgspec.json.encode(message(numbers)).removesuffix(_SENT)
        return b'{"hand":"%s","seq":%d,"stamp_ns":%d%s' % (
            points.hand.encode(),
            points.seq,
            points.stamp_ns,
            body,
        )


def _template(message: Callable[[Array], HandPose], outcomes: Array) -> Template:
    """The text of a pose behind its stamp, with gaps; outcomes (5,) of its digits."""
    numbers = _FIRST + np.arange(256.0).reshape(32, 8)
    numbers[DIGIT_ROWS, OUTCOME] = outcomes
    text = msgspec.json.encode(message(numbers)).removesuffix(_SENT)
    text = text[text.index(b',"method"') :]
    pieces, slots, decimals, begin = [], [], [], 0
    for gap in _GAP.finditer(text):
        pieces.append(text[begin : gap.start()])
        slots.append(int(float(gap[0])) - int(_FIRST))
        decimals.append(DECIMALS if gap[1] else -1)
        begin = gap.end()
    pieces.append(text[begin:])
    return Template(
        np.frombuffer(b"".join(pieces), dtype=np.uint8).copy(),
        np.cumsum([len(piece) for piece in pieces]),
        np.array(slots),
        np.array(decimals),
    )
