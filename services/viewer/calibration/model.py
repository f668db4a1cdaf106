"""Calibrating one camera's colours in the page: what was pointed at, what came of it, what a person
changed by hand. Pure.

The ranges shown and saved are those in force, under those fitted to what was pointed at, under
those set with the sliders. A place that shows no paint is forgotten again, with the reason; nothing
is in force before it is saved.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import msgspec

from rhot.camera_messages import ColorRange, Colors, FitRequest, FitResult, PointedAt

# What sliders begin with for a colour that nobody has pointed at yet: everything saturated.
_ANY = ColorRange(hsv_low=(0, 80, 40), hsv_high=(179, 255, 255))


@dataclass
class Session:
    """One camera's calibration.

    wanted are the colours of rig.toml, next_camera is one that was not calibrated yet, "" if all
    were.
    """

    camera: str
    wanted: list[str]
    in_force: Colors = field(default_factory=lambda: Colors(colors={}))
    pointed: list[PointedAt] = field(default_factory=list)
    result: FitResult = field(default_factory=FitResult)
    edited: dict[str, ColorRange] = field(default_factory=dict)
    error: str = ""
    saved: str = ""
    next_camera: str = ""

    @property
    def names(self) -> list[str]:
        """Colours there are: rig.toml's, else those in force; never none."""
        return self.wanted or sorted(self.in_force.colors) or ["green"]

    @property
    def ranges(self) -> dict[str, ColorRange]:
        """Of every colour that has any."""
        return {**self.in_force.colors, **self.result.colors, **self.edited}

    def range_of(self, color: str) -> ColorRange:
        """What the sliders show."""
        return self.ranges.get(color, _ANY)

    @property
    def changed(self) -> bool:
        """Whether there is anything to save."""
        return self.ranges != self.in_force.colors

    @property
    def missing(self) -> list[str]:
        """Colours of rig.toml without a range: they are not tracked."""
        return [name for name in self.wanted if name not in self.ranges]

    def point(self, color: str, picture: str, x_px: float, y_px: float) -> None:
        """A click on a marker."""
        self.pointed.append(
            PointedAt(color=color, picture=picture, x_px=round(x_px, 1), y_px=round(y_px, 1))
        )
        self.error = self.saved = ""

    def request(self) -> FitRequest:
        """What the tracker is to fit."""
        return FitRequest(pointed=self.pointed)

    def take(self, result: FitResult | None) -> bool:
        """The tracker's answer to the last click, None if there was none.

        Whether it showed paint.
        """
        if result is None or result.error:
            self.error = result.error if result else "the tracker does not answer; is it running?"
            if self.pointed:
                self.pointed.pop()
            return False
        self.result, self.error = result, ""
        for color in {one.color for one in self.pointed[-1:]}:
            # Who points at a colour again wants it fitted anew.
            self.edited.pop(color, None)
        return True

    def take_proposal(self, result: FitResult | None) -> bool:
        """The tracker's proposal of everything that stands out: as if it had been pointed at."""
        if result is None or result.error:
            self.error = result.error if result else "the tracker does not answer; is it running?"
            return False
        known = {
            name: span
            for name, span in result.colors.items()
            if not self.wanted or name in self.wanted
        }
        self.result = msgspec.structs.replace(result, colors=known)
        self.pointed = [
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

    def undo(self) -> None:
        """Forget the last click; what is left must be fitted again."""
        if self.pointed:
            self.pointed.pop()
        if not self.pointed:
            self.result = FitResult()
        self.error = self.saved = ""

    def reset(self) -> None:
        """Back to what is in force."""
        self.pointed.clear()
        self.edited.clear()
        self.result, self.error, self.saved = FitResult(), "", ""

    def edit(self, color: str, span: ColorRange) -> None:
        """A slider was moved."""
        self.edited[color] = span
        self.saved = ""

    def next_after(self, color: str) -> str:
        """The next colour nobody has pointed at, else this one."""
        done = {one.color for one in self.pointed}
        names = self.names
        at = names.index(color) if color in names else 0
        return next((name for name in names[at + 1 :] + names[:at] if name not in done), color)

    def file(self, date: str) -> Colors:
        """What is saved."""
        places = [f"{p.color}={p.x_px:g},{p.y_px:g}" for p in self.pointed]
        inputs = {"places": places, "by_hand": sorted(self.edited)}
        return Colors(
            date=date,
            tool="rhot viewer",
            inputs=inputs,
            residuals=self.result.residuals,
            colors=self.ranges,
        )

    def was_saved(self, made: Colors) -> None:
        """It is in force now."""
        self.in_force, self.saved, self.error = made, made.date, ""
        self.edited.clear()
