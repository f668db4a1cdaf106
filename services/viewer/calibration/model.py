"""Calibrating one camera's colours in the page: what was clicked, what was fitted to it, what a
person changed by hand. Pure.

The ranges shown are the applied ones, overridden by those fitted to the clicks, overridden by those
set with the sliders. A click that shows no paint is forgotten again, with the reason. The tracker
uses the ranges only once they are applied.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TypeGuard

import msgspec

from rhot.messages.camera import ColorRange, Colors, FitRequest, FitResult, PointedAt

# What sliders begin with for a colour that was not clicked yet: everything saturated.
_ANY = ColorRange(hsv_low=(0, 80, 40), hsv_high=(179, 255, 255))
_NO_ANSWER = "the tracker does not answer; is it running?"


@dataclass
class ColorCalibration:
    """The calibration of one camera's colours.

    wanted are the colours of rig.toml, applied is what the tracker uses now. saved is the date of
    what was applied from here. next_camera is one that was not calibrated yet, "" if all were.
    """

    camera: str
    wanted: list[str]
    applied: Colors = field(default_factory=lambda: Colors(colors={}))
    clicks: list[PointedAt] = field(default_factory=list)
    result: FitResult = field(default_factory=FitResult)
    edited: dict[str, ColorRange] = field(default_factory=dict)
    error: str = ""
    saved: str = ""
    next_camera: str = ""

    @property
    def names(self) -> list[str]:
        """The colours to calibrate: rig.toml's, else the applied ones; never none."""
        return self.wanted or sorted(self.applied.colors) or ["green"]

    @property
    def ranges(self) -> dict[str, ColorRange]:
        """The range of every colour that has one."""
        return {**self.applied.colors, **self.result.colors, **self.edited}

    def range_of(self, color: str) -> ColorRange:
        """What the sliders show."""
        return self.ranges.get(color, _ANY)

    @property
    def changed(self) -> bool:
        """Whether there is anything to apply."""
        return self.ranges != self.applied.colors

    @property
    def missing(self) -> list[str]:
        """Colours of rig.toml without a range: they are not tracked."""
        return [name for name in self.wanted if name not in self.ranges]

    def click(self, color: str, picture: str, x_px: float, y_px: float) -> None:
        """Take a click on a marker."""
        self.clicks.append(
            PointedAt(color=color, picture=picture, x_px=round(x_px, 1), y_px=round(y_px, 1))
        )
        self.error = self.saved = ""

    def request(self) -> FitRequest:
        """What the tracker is to fit."""
        return FitRequest(pointed=self.clicks)

    def take_fit(self, result: FitResult | None) -> bool:
        """Take the tracker's answer to the last click, None if there was none.

        Returns whether the click showed paint.
        """
        if not self._is_good(result):
            if self.clicks:
                self.clicks.pop()
            return False
        self.result, self.error = result, ""
        for color in {click.color for click in self.clicks[-1:]}:
            # Who clicks a colour again wants it fitted anew.
            self.edited.pop(color, None)
        return True

    def take_proposal(self, result: FitResult | None) -> bool:
        """Take the tracker's proposal of everything that stands out, as if it had been clicked."""
        if not self._is_good(result):
            return False
        known = {
            name: span
            for name, span in result.colors.items()
            if not self.wanted or name in self.wanted
        }
        self.result = msgspec.structs.replace(result, colors=known)
        self.clicks = [
            PointedAt(
                color=p.color,
                picture=p.picture,
                x_px=p.box_px[0],
                y_px=p.box_px[1],
                width_px=p.box_px[2],
                height_px=p.box_px[3],
            )
            for p in result.patches
            if p.color in known
        ]
        self.edited.clear()
        self.error = self.saved = ""
        return True

    def _is_good(self, result: FitResult | None) -> TypeGuard[FitResult]:
        """Whether an answer came and is no refusal; the error says what it is otherwise."""
        if result is None or result.error:
            self.error = result.error if result else _NO_ANSWER
            return False
        return True

    def undo(self) -> None:
        """Forget the last click; what is left must be fitted again."""
        if self.clicks:
            self.clicks.pop()
        if not self.clicks:
            self.result = FitResult()
        self.error = self.saved = ""

    def reset(self) -> None:
        """Back to what is applied."""
        self.clicks.clear()
        self.edited.clear()
        self.result, self.error, self.saved = FitResult(), "", ""

    def edit(self, color: str, span: ColorRange) -> None:
        """Take a range that was set with the sliders."""
        self.edited[color] = span
        self.saved = ""

    def next_to_click(self, color: str) -> str:
        """The first colour from this one on that was not clicked, else this one."""
        done = {click.color for click in self.clicks}
        names = self.names
        at = names.index(color) if color in names else 0
        return next((name for name in names[at:] + names[:at] if name not in done), color)

    def as_file(self, date: str) -> Colors:
        """What is saved."""
        places = [f"{click.color}={click.x_px:g},{click.y_px:g}" for click in self.clicks]
        inputs = {"places": places, "by_hand": sorted(self.edited)}
        return Colors(
            date=date,
            tool="rhot-viewer",
            inputs=inputs,
            residuals=self.result.residuals,
            colors=self.ranges,
        )

    def was_applied(self, made: Colors) -> None:
        """The tracker uses these now."""
        self.applied, self.saved, self.error = made, made.date, ""
        self.edited.clear()
