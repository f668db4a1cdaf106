"""All that is watched in a camera's pictures, as faults with a sentence each. Pure.

Frame by frame: whether it is a new picture. Once a second: what is wrong now.
"""

from __future__ import annotations

from services.pi_tracker.image.frame import Frame
from services.pi_tracker.monitors.frame_rate import WINDOW_S, FrameRate
from services.pi_tracker.monitors.picture_content import PictureContent
from services.pi_tracker.monitors.repeated_picture import RepeatedPicture

# The codes that `beat` may give; those it does not give are over.
CODES = ("camera_dark", "camera_frozen", "camera_saturated", "camera_slow")
# What sends the pictures may start after its tracker: a demo's simulator is ready 10 s after it
# where fifteen other processes use the two cores.
_FIRST_S = 15.0


class CameraMonitor:
    """Watches the pictures of one camera; its recordings (live false) are as they are."""

    def __init__(self, camera: str, fps: float, *, live: bool) -> None:
        self._camera, self._fps, self._live = camera, fps, live
        self._rate = FrameRate(fps)
        self._repeated = RepeatedPicture()
        self._content = PictureContent()
        self._any = False
        self._began_ns: int | None = None

    @property
    def rate_hz(self) -> float | None:
        """New pictures a second, None until there have been some seconds of them."""
        return self._rate.rate_hz

    @property
    def repeated(self) -> int:
        """Pictures that came again."""
        return self._repeated.repeated

    def is_new(self, frame: Frame, now_ns: int) -> bool:
        """Whether the frame is a new picture; one that comes again must not be measured again."""
        self._any = True
        if self._live and self._repeated.update(frame, now_ns):
            return False
        self._rate.count()
        return True

    def watch(self, frame: Frame, markers: int, now_ns: int) -> None:
        """A picture, new or not, in which so many markers were found."""
        self._content.update(frame, markers, now_ns)

    def beat(self, now_ns: int, skipped: int = 0) -> dict[str, str]:
        """What is wrong now, by code, about once a second.

        skipped counts the frames that this computer was too slow for, since the start.
        """
        self._rate.beat(now_ns)
        if self._began_ns is None:
            self._began_ns = now_ns
        found: dict[str, str] = {}
        if self._content.code == "camera_dark":
            found["camera_dark"] = (
                f"the picture of camera {self._camera!r} is black: 99 % of it are darker than "
                f"{self._content.luma:.0f} of 255"
            )
        elif self._content.code == "camera_saturated":
            found["camera_saturated"] = (
                f"{100 * self._content.white:.0f} % of the picture of camera {self._camera!r} "
                "are white"
            )
        frozen_s = self._repeated.frozen_s(now_ns)
        if not self._live:
            return found
        # A picture without noise, since it is clipped, may repeat.
        if frozen_s and not found:
            found["camera_frozen"] = (
                f"camera {self._camera!r} has delivered the same picture for {frozen_s:.0f} s"
            )
        elif self._rate.slow and not frozen_s:
            found["camera_slow"] = self._slow_text(skipped)
        elif not self._any and now_ns - self._began_ns >= _FIRST_S * 1e9:
            found["camera_slow"] = f"camera {self._camera!r} has delivered no picture yet"
        return found

    def _slow_text(self, skipped: int) -> str:
        text = (
            f"camera {self._camera!r} delivers {self._rate.rate_hz or 0.0:.1f} pictures a second "
            f"of {self._fps:g}"
        )
        if self.repeated:
            text += f"; {self.repeated} came twice"
        if skipped:
            text += f"; {skipped} were left out, as this computer was too slow"
        return text + f" (over {WINDOW_S:.0f} s)"
