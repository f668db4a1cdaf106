"""Videos as phones write them: H.264 at a variable rate, trimmed without encoding them again."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import numpy.typing as npt

# The clock of most phones' videos, 1/s.
_TICKS = 90_000
# A key frame a second at 30 fps: a video can be trimmed there without encoding it again.
_KEY_FRAMES = 30

Picture = npt.NDArray[np.uint8]


def write_phone_video(
    path: Path, pictures: Iterable[Picture], times_s: Sequence[float], quality: int = 18
) -> None:
    """RGB pictures (h, w, 3), each to be shown at its time; with frames that refer to later ones.

    quality: x264's rate factor, 0 lossless to 51.
    """
    with av.open(str(path), "w") as container:
        options = {
            "preset": "ultrafast",
            "crf": str(quality),
            "x264-params": f"bframes=2:b-adapt=0:keyint={_KEY_FRAMES}",
        }
        stream = container.add_stream("libx264", rate=30, options=options)
        stream.codec_context.time_base = Fraction(1, _TICKS)
        for picture, time_s in zip(pictures, times_s, strict=True):
            frame = av.VideoFrame.from_ndarray(picture, "rgb24")
            if not stream.codec_context.is_open:
                stream.width, stream.height = frame.width, frame.height
                stream.pix_fmt = "yuv420p"
            frame.pts = round(time_s * _TICKS)
            frame.time_base = Fraction(1, _TICKS)
            container.mux(stream.encode(frame))
        container.mux(stream.encode())


def trim(source: Path, trimmed: Path, from_s: float) -> None:
    """Leave out the beginning as phones do: frames before from_s stay in the file, unshown."""
    with (
        av.open(str(source)) as old,
        # Times before 0 make the edit list that says where to begin.
        av.open(str(trimmed), "w", options={"avoid_negative_ts": "disabled"}) as new,
    ):
        stream = old.streams.video[0]
        copy = new.add_stream_from_template(stream)
        assert stream.time_base is not None
        shift = round(Fraction(from_s) / stream.time_base)
        old.seek(int(from_s * 1e6))
        for packet in old.demux(stream):
            if packet.dts is None or packet.pts is None:
                continue
            packet.pts, packet.dts = packet.pts - shift, packet.dts - shift
            packet.stream = copy
            new.mux(packet)
