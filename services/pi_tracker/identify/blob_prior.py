"""How likely blobs are a colour's marker, by its track and by the other colours' blobs. Pure."""

from __future__ import annotations

from collections.abc import Sequence

from services.pi_tracker.identify.blob_shape import may_be_rim
from services.pi_tracker.identify.group_consistency import SIZE_RATIO
from services.pi_tracker.identify.track import Track
from services.pi_tracker.image.blob import Blob

# Accept threshold: a blob as like its own track as this, and the only one of its colour, is the
# marker without a comparison with the others.
ACCEPT_LIKENESS = 0.6
# Re-acquisition prior: however unlike its track, a blob consistent with the others may be the
# marker after all. The track may have been wrong.
_REACQUISITION_PRIOR = 0.4
# No marker shrinks to such a share of its size within so long; what does is noise, or something
# pale that a dim light brings near. Its prior. But what is as large as the other markers is one:
# the track is of another thing then, like a poster before which a tip was first seen.
_SHRUNK_SHARE, _SHRUNK_NS, _NOISE_PRIOR = 1.0 / 16.0, 5_000_000_000, 0.1
# A track that stands still for so many frames may be no marker.
_STATIONARY_FRAMES = 4
# What is smaller than such a share of a marker is no rival to it: noise makes some in each picture.
_RIVAL_SHARE = 0.2
# Factor of a prior where the blob may be the rim of another's paint, unless it is where the marker
# itself must be by now (Track.is_at): half occluded by the other.
_RIM_FACTOR = 0.3


def blob_priors(
    color: int,
    blobs: Sequence[Sequence[Blob]],
    track: Track | None,
    stamp_ns: int,
    margin_px: float,
    others_px2: float,
) -> list[float]:
    """Priors, 0..1, of a colour's blobs, of those of each colour.

    others_px2: how large the other colours' markers are, the median of them; 0 if none was seen.
    """
    own = blobs[color]
    others = [blob for number, rest in enumerate(blobs) if number != color for blob in rest]
    priors = [_prior(blob, others, track, stamp_ns, margin_px, others_px2) for blob in own]
    if track is not None and track.stationary_frames >= _STATIONARY_FRAMES:
        # What has not moved for a while may be static background; among others it has no advantage.
        least_px2 = _RIVAL_SHARE * track.area_px
        if sum(blob.area_px >= least_px2 for blob in own) > 1:
            return [min(prior, _REACQUISITION_PRIOR) for prior in priors]
    return priors


def _prior(
    blob: Blob,
    others: Sequence[Blob],
    track: Track | None,
    stamp_ns: int,
    margin_px: float,
    others_px2: float,
) -> float:
    prior = 1.0
    if track is not None:
        likeness = track.likeness(blob, stamp_ns, margin_px)
        if likeness >= ACCEPT_LIKENESS:
            return likeness
        prior = max(likeness, _REACQUISITION_PRIOR)
        if track.is_at(blob, stamp_ns):
            return max(prior, ACCEPT_LIKENESS)
        recently_larger = 0 <= stamp_ns - track.seen_ns <= _SHRUNK_NS
        like_others = 0.0 < others_px2 <= SIZE_RATIO * blob.area_px
        if recently_larger and blob.area_px < _SHRUNK_SHARE * track.area_px and not like_others:
            return _NOISE_PRIOR
    return prior * _RIM_FACTOR if any(may_be_rim(blob, other) for other in others) else prior
