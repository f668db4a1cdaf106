"""Sub-pixel positions, and sigmas that are true."""

from __future__ import annotations

import numpy as np
import pytest

from services.pi_tracker.detect.search_region import whole
from services.pi_tracker.image.yuv_planes import picture
from services.pi_tracker.measure.centroid import centroids


def measure(detector, noise, frame):
    image = picture(frame)
    blobs = detector.detect(image, whole(image.size))
    names = [detector.names[blob.color] for blob in blobs]
    return dict(zip(names, centroids(image, blobs, noise), strict=True))


def pairs(studio, tip, detector, noise, count=72):
    """(n, 2, 2): error of both views of a tip, independently noisy, sub-pixel apart.

    And (n,) sigmas.
    """
    rng = np.random.default_rng(1)
    errors, sigmas = [], []
    for i in range(count):
        name = list(studio.paints)[i % 6]
        x, y, apart = 32 + rng.uniform(-1, 1), 32 + rng.uniform(-1, 1), rng.uniform(-1, 1)
        wall = tuple(rng.uniform(60, 200) + rng.uniform(-10, 10, 3))
        shape = {
            "length_px": 9 * rng.uniform(0.9, 1.3),
            "turn_rad": rng.uniform(0, 2 * np.pi),
            "light_rad": rng.uniform(-1, 1),
        }
        views = []
        for side in range(2):
            frame, truth = studio.frame(
                [tip(name, x + side * apart, y, 9.0, **shape)], seq=2 * i + side, wall=wall
            )
            found = measure(detector, noise, frame)[name]
            views.append((found.x_px - truth[name][0], found.y_px - truth[name][1]))
            sigmas.append(found.sigma_px)
        errors.append(views)
    return np.array(errors), np.array(sigmas)


def test_disparity_and_bias_of_a_small_tip(studio, tip, detector, noise):
    errors, sigmas = pairs(studio, tip, detector, noise)
    disparity = errors[:, 1, 0] - errors[:, 0, 0]
    # The paper's pipeline: .22 px; binary moments: .10.
    assert np.sqrt(np.mean(disparity**2)) <= 0.06
    # Against the middle of the visible paint, lit from all sides.
    assert np.sqrt(np.mean(errors**2)) <= 0.2
    assert np.abs(errors.mean(axis=(0, 1))).max() <= 0.05
    # Sigmas agree with the errors: neither too small nor too large.
    assert 0.3 <= np.sqrt(np.mean(errors.reshape(-1, 2) ** 2 / sigmas[:, None] ** 2)) <= 1.3


@pytest.mark.parametrize("sigma", [2.0, 5.0, 8.0])
def test_more_noise_is_more_sigma(studio, tip, detector, noise, sigma):
    noise.luma, noise.chroma = 0.29 * sigma, 0.28 * sigma
    frames = [
        studio.frame([tip("green", 32.0, 32.0)], seq=seq, sigma=sigma)[0] for seq in range(12)
    ]
    found = [measure(detector, noise, frame)["green"] for frame in frames]
    scatter = np.std([(one.x_px, one.y_px) for one in found], axis=0).mean()
    assert scatter < 1.3 * np.mean([one.sigma_px for one in found])


def test_a_dab_in_the_middle_of_skin_is_unbiased(studio, tip, detector, noise):
    errors = []
    for seq in range(16):
        x, y = 32 + 0.13 * seq - 1, 31 + 0.07 * seq
        frame, truth = studio.frame(
            [tip("violet", x, y, 12.0, 12.0, turn_rad=0.3 * seq)], seq=seq, sigma=2.0, shading=0.0
        )
        found = measure(detector, noise, frame)["violet"]
        errors.append((found.x_px - truth["violet"][0], found.y_px - truth["violet"][1]))
    assert np.abs(np.mean(errors, axis=0)).max() < 0.06


def test_a_neighbouring_finger_does_not_pull(studio, tip, detector, noise):
    alone, _ = studio.frame([tip("green", 26.0, 32.0, turn_rad=1.57)], sigma=1.0)
    both, _ = studio.frame(
        [tip("green", 26.0, 32.0, turn_rad=1.57), tip("blue", 38.0, 32.0, turn_rad=1.57)], sigma=1.0
    )
    a, b = measure(detector, noise, alone)["green"], measure(detector, noise, both)["green"]
    assert np.hypot(a.x_px - b.x_px, a.y_px - b.y_px) < 0.2


def test_layouts_agree(studio, tip, detector, noise):
    one = [studio.frame([tip("cyan", 30.3, 33.1)], layout=layout)[0] for layout in ("i420", "bgr")]
    a, b = (measure(detector, noise, frame)["cyan"] for frame in one)
    assert (a.x_px, a.y_px) == pytest.approx((b.x_px, b.y_px), abs=0.05)


@pytest.mark.parametrize(
    ("x", "y"), [(0.0, 30.0), (63.0, 30.0), (30.0, 0.0), (30.0, 63.0), (1.0, 1.0)]
)
def test_at_the_edge_of_the_image(studio, tip, detector, noise, x, y):
    frame, _ = studio.frame([tip("green", x, y, 14.0, 14.0)])
    found = measure(detector, noise, frame)["green"]
    assert -0.5 <= found.x_px <= 63.5
    assert -0.5 <= found.y_px <= 63.5
    assert np.isfinite(found.sigma_px)
    middle = measure(detector, noise, studio.frame([tip("green", 32.0, 32.0, 14.0, 14.0)])[0])[
        "green"
    ]
    assert found.quality < 0.5 < middle.quality


def test_large_blobs_are_measured_beside_small_ones(studio, tip, detector, noise):
    frame, truth = studio.frame(
        [tip("green", 60.0, 80.0, 90.0, 90.0), tip("blue", 150.0, 80.0, 9.0, 10.0)],
        size_px=(180, 160),
    )
    found = measure(detector, noise, frame)
    assert (found["green"].x_px, found["green"].y_px) == pytest.approx(truth["green"], abs=1.5)
    assert (found["blue"].x_px, found["blue"].y_px) == pytest.approx(truth["blue"], abs=0.3)


def test_no_blobs_no_centroids(studio, noise):
    frame, _ = studio.frame([])
    assert centroids(picture(frame), [], noise) == []


def test_blobs_measured_together_are_measured_as_if_alone(studio, tip, detector, noise):
    # Side by side in one stack of tiles, of several sizes.
    places = {
        "green": (30.0, 20.0, 8.0),
        "blue": (90.0, 24.0, 16.0),
        "lime": (33.0, 70.0, 9.0),
        "violet": (92.0, 76.0, 12.0),
    }
    frame, _ = studio.frame(
        [tip(name, x, y, width) for name, (x, y, width) in places.items()], size_px=(128, 100)
    )
    image = picture(frame)
    blobs = detector.detect(image, whole(image.size))
    assert len(blobs) == len(places)
    for together, blob in zip(centroids(image, blobs, noise), blobs, strict=True):
        (alone,) = centroids(image, [blob], noise)
        assert together == pytest.approx(alone, abs=1e-3)


def test_a_blob_at_the_left_edge_leaves_its_neighbour_in_the_stack_alone(
    studio, tip, detector, noise
):
    """Tiles lie side by side: what a mask at the edge gains must not count in the tile before."""
    frame, _ = studio.frame([tip("green", 40.0, 32.0), tip("blue", 1.0, 32.0)], sigma=0.0)
    image = picture(frame)
    blobs = {detector.names[blob.color]: blob for blob in detector.detect(image, whole(image.size))}
    inner, cut = blobs["green"], blobs["blue"]
    assert cut.rect[0] == 0
    alone, (beside, _) = (centroids(image, of, noise) for of in ([inner], [inner, cut]))
    assert beside == pytest.approx(alone[0], abs=1e-5)
