"""One frame in, one MarkerFrame out: the whole of pi_tracker without its process.

Pure: the same object runs live, in `rhot track`, in replay and in tests. A frame without any marker
gives a MarkerFrame without markers; frames may skip and repeat. A colour without calibration is a
CalibrationError at the start, not later.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import cv2

from rhot.files.calibration import Colors, Lens
from rhot.files.rig_tables import Tracker
from rhot.messages import Marker, MarkerFrame
from rhot.messages.camera import SeenInPicture
from services.pi_tracker.detect.color_table import ColorTable, compile_colors
from services.pi_tracker.detect.marker_finder import MarkerFinder
from services.pi_tracker.detect.near_colors import near_tables
from services.pi_tracker.detect.paper_finder import PaperFinder
from services.pi_tracker.dots.finder import DotFinder, dot_markers
from services.pi_tracker.identify.hand_layout import NO_LANDMARKS, Landmarks
from services.pi_tracker.image.frame import Frame
from services.pi_tracker.image.rectify import Rectifier

Clock = Callable[[], int]


class TrackerStep:
    """The tracker of one camera.

    color_names are the colours to track; all must be in colors, else CalibrationError (naming
    colors_path). size_px is the size in rig.toml; a frame of another size is tracked as it is.
    clock, if given, is read at the end of each stage, for times_ms. With a lens, frames are
    undistorted first (image/rectify.py). dots are colours that several landmarks share, with the
    names of their markers by landmark (RigConfig.dots); seeds are where landmarks are in the first
    picture, px; remembers_dots keeps what looked_back() needs. landmarks are what colours mark
    (RigConfig.landmarks): a hand is then told by its layout, too.
    """

    def __init__(
        self,
        camera_name: str,
        colors: Colors,
        settings: Tracker,
        size_px: tuple[int, int],
        color_names: Sequence[str],
        clock: Clock | None = None,
        colors_path: Path | str = "",
        lens: Lens | None = None,
        dots: Mapping[str, Mapping[str, str]] | None = None,
        seeds: Mapping[str, tuple[float, float]] | None = None,
        *,
        remembers_dots: bool = False,
        landmarks: Landmarks = NO_LANDMARKS,
        readout_ms: float = 0.0,
    ) -> None:
        # More OpenCV threads gain nothing on images this small, and cost the other cores.
        cv2.setNumThreads(1)
        self.camera_name = camera_name
        self.size_px = size_px
        self._settings = settings
        self._color_names = tuple(color_names)
        self._rectifier = None if lens is None else Rectifier(lens)
        self._clock = clock
        self._last_ns = 0
        wanted = {} if dots is None else dots
        self._names = {color: wanted[color] for color in self._color_names if color in wanted}
        self._seeds = seeds or {}
        self._remembers_dots = remembers_dots
        self._landmarks = landmarks
        self._readout_ms = readout_ms
        self._dots: dict[str, DotFinder] = {}
        # Duration of each stage of the last step in ms; empty without a clock.
        self.times_ms: dict[str, float] = {}
        self.apply_colors(colors, colors_path or f"{camera_name}.colors.json")

    def apply_colors(self, colors: Colors, path: Path | str) -> None:
        """Use new colour ranges from the next frame on.

        Raises CalibrationError and keeps the old ones.
        """
        table = compile_colors(colors, self._color_names, path)
        self._use_for_dots(table)
        single = tuple(name for name in self._color_names if name not in self._names)
        self._finder: MarkerFinder | PaperFinder | None = None
        if not single and self._names:
            return
        if self._settings.method == "paper":
            self._finder = PaperFinder(colors, self._settings, single)
        else:
            own = compile_colors(colors, single, path) if self._names else table
            near = near_tables(colors, single, path)
            self._finder = MarkerFinder(
                own, near, self._settings, self._time_stage, self._landmarks
            )

    @property
    def notes(self) -> list[str]:
        """What a person should know of how the dots of one colour were told apart."""
        return [note for finder in self._dots.values() for note in finder.tracker.notes]

    def seen(self, found: MarkerFrame) -> SeenInPicture:
        """What people are told of the picture that the last step was made of."""
        # Of a picture that was rectified first, a rectangle is none any more.
        finder = self._finder if self._rectifier is None else None
        return SeenInPicture(
            stamp_ns=found.stamp_ns,
            size_px=found.size_px,
            markers=found.markers,
            looked_for=[name for name in self._color_names if name not in self._names]
            + [marker for names in self._names.values() for marker in names.values()],
            searched_px=finder.searched_px if isinstance(finder, MarkerFinder) else None,
        )

    def step(self, frame: Frame, clock_offset_ns: int = 0, clock_sigma_ns: int = -1) -> MarkerFrame:
        """Find the markers of one frame.

        The offset is the camera clock's, as rhot.clock estimates it.
        """
        if self._clock is not None:
            started_ns = self._last_ns = self._clock()
        markers = self._find(frame)
        if self._clock is not None:
            self.times_ms["step"] = (self._clock() - started_ns) * 1e-6
        return MarkerFrame(
            camera=self.camera_name,
            seq=frame.seq,
            stamp_ns=frame.stamp_ns,
            row_time_ns=frame.row_time_ns or 1e6 * self._readout_ms / frame.size_px[1],
            clock_offset_ns=clock_offset_ns,
            clock_sigma_ns=clock_sigma_ns,
            size_px=frame.size_px,
            markers=markers,
        )

    def looked_back(self, advance: Callable[[], None] = lambda: None) -> list[list[Marker]]:
        """Of each step so far the markers that are dots of a shared colour, with hindsight.

        Empty where there are none, or where they are not remembered. advance is called
        looking_back.LOOKS times for each step and colour.
        """
        frames: list[list[Marker]] = []
        for color, finder in self._dots.items():
            told = [dot_markers(dots, self._names[color]) for dots in finder.looked_back(advance)]
            frames = [a + b for a, b in zip(frames, told, strict=True)] if frames else told
        rectifier = self._rectifier
        return frames if rectifier is None else [rectifier.to_camera_pixels(f) for f in frames]

    @property
    def learns_room(self) -> bool:
        """Whether it gets to know what stands still, and nothing hangs on its first picture."""
        return isinstance(self._finder, MarkerFinder) and not self._names

    @property
    def dot_names(self) -> set[str]:
        """The markers that are dots of a shared colour."""
        return {name for names in self._names.values() for name in names.values()}

    def _use_for_dots(self, table: ColorTable) -> None:
        for color, names in self._names.items():
            if color in self._dots:
                self._dots[color].use(table)
                continue
            seeds = {name: self._seeds[name] for name in names if name in self._seeds}
            self._dots[color] = DotFinder(
                table,
                color,
                self._settings,
                tuple(names),
                self.size_px,
                seeds,
                remembers=self._remembers_dots,
            )

    def _find(self, frame: Frame) -> list[Marker]:
        if self._rectifier is None:
            return self._all_markers(frame)
        rectified = self._rectifier.rectify(frame)
        self._time_stage("rectify")
        return self._rectifier.to_camera_pixels(self._all_markers(rectified))

    def _all_markers(self, frame: Frame) -> list[Marker]:
        markers = [] if self._finder is None else self._finder.find(frame)
        for color, finder in self._dots.items():
            markers += dot_markers(finder.find(frame), self._names[color])
        if self._dots:
            self._time_stage("dots")
        return markers

    def _time_stage(self, stage: str) -> None:
        """Note how long the stage that ends now took."""
        if self._clock is not None:
            now_ns = self._clock()
            self.times_ms[stage] = (now_ns - self._last_ns) * 1e-6
            self._last_ns = now_ns
