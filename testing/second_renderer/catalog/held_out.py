"""Clips that no constant is chosen on, and that are looked at rarely."""

from __future__ import annotations

from testing.second_renderer.catalog.lights import COLD, DARK, PALE, WARM, WINDOW
from testing.second_renderer.clip import Clip, Rig
from testing.second_renderer.motion import Carried, Play
from testing.second_renderer.paint import Job
from testing.second_renderer.pictures import Shutter
from testing.second_renderer.sensor import Sensor
from testing.second_renderer.skin import Build

HELD_OUT: dict[str, Clip] = {
    "wait": Clip(
        Play("HandSplay-110fps", Carried("wait", 30.0, 0.4), 0.3, 0.2, 0.6, tilt_deg=15.0),
        job=Job((12.0, 17.0), 0.9, dab_off_mm=4.0, skin=DARK, seed=23),
        light=WINDOW,
        sensor=Sensor(jpeg=88, blur_px=0.7),
        rig=Rig(baseline_m=0.07, phase_s=0.0189, skew_s=-0.011),
        given_scale=1.04,
        seed=23,
    ),
    "grab and roll, child": Clip(
        Play("grab", Carried("roll", 22.0, 0.45), 0.5, 0.1, 0.4, scale=0.8, distance_m=0.4),
        build=Build(0.97, 1.0),
        job=Job((9.0, 12.0), 0.6, skin=PALE, seed=25),
        light=COLD,
        sensor=Sensor(electrons=2200.0),
        rig=Rig(fov_deg=58.0, phase_s=0.0036),
        given_scale=0.84,
        seed=25,
    ),
    "waving far off": Clip(
        Play("wave", Carried("drift", 50.0, 0.5), 0.8, scale=1.06, distance_m=0.65),
        job=Job((14.0, 18.0), 1.0, skin=(0.35, 0.19, 0.13), seed=26),
        light=WARM,
        sensor=Sensor(gain=0.9, white=(0.97, 1.04)),
        rig=Rig(baseline_m=0.11, toe_in_deg=4.0, phase_s=0.0157),
        given_scale=1.02,
        seed=26,
    ),
    "grab, violet picture": Clip(
        Play("grab", Carried("roll", 25.0, 0.5), 0.5, 0.1, 0.6, distance_m=0.5, at=(0.02, -0.06)),
        job=Job((11.0, 16.0), 0.7, skin=DARK, seed=42),
        light=COLD,
        rig=Rig(phase_s=0.0219, toe_in_deg=3.0),
        given_scale=0.97,
        seed=42,
    ),
    "roll, magenta picture": Clip(
        Play("pinch", Carried("roll", 26.0, 0.5), 0.5, 0.1, 0.7, at=(-0.04, 0.06)),
        build=Build(1.03, 1.02),
        job=Job((12.0, 16.0), 0.9, skin=(0.6, 0.36, 0.27), seed=55),
        light=WARM,
        rig=Rig(phase_s=0.0098, baseline_m=0.095),
        given_scale=1.03,
        seed=55,
    ),
    "flapping before stripes": Clip(
        Play("wave", Carried("flap", 20.0, 0.6), 0.5, at=(-0.07, 0.05), distance_m=0.48),
        build=Build(0.99, 1.0),
        job=Job((11.0, 15.0), 0.8, dab_off_mm=3.0, skin=PALE, seed=59),
        sensor=Sensor(jpeg=90, blur_px=0.6),
        rig=Rig(phase_s=0.0191, toe_in_deg=1.0),
        seed=59,
    ),
    # Made on 2026-11-29, and looked at four times that day.
    "splay, large hand": Clip(
        Play(
            "HandSplay-110fps",
            Carried("roll", 22.0, 0.35),
            0.6,
            scale=1.1,
            distance_m=0.56,
            yaw_deg=-8.0,
        ),
        build=Build(1.04, 1.02),
        job=Job((14.0, 19.0), 0.9, dab_off_mm=4.0, skin=DARK, seed=71),
        light=WINDOW,
        sensor=Sensor(electrons=1600.0, jpeg=87),
        rig=Rig(baseline_m=0.088, phase_s=0.0129, toe_in_deg=2.5),
        given_scale=1.04,
        seed=71,
    ),
    "pinch, drifting, small hand": Clip(
        Play(
            "pinch",
            Carried("drift", 60.0, 0.3),
            0.6,
            0.2,
            0.8,
            scale=0.87,
            distance_m=0.41,
            roll_deg=12.0,
        ),
        build=Build(0.98, 0.97),
        job=Job((9.0, 13.0), 0.8, skin=(0.5, 0.3, 0.21), seed=72),
        light=WARM,
        sensor=Sensor(gain=1.05, blur_px=0.7),
        rig=Rig(phase_s=0.0201, fov_deg=60.0),
        given_scale=0.92,
        seed=72,
    ),
    "grab, slowly": Clip(
        Play("grab", Carried("roll", 14.0, 0.3), 0.35, 0.05, 0.5, distance_m=0.45, tilt_deg=8.0),
        build=Build(0.96, 1.03),
        job=Job((11.0, 15.0), 0.7, dab_off_mm=3.0, seed=74),
        light=WARM,
        shutter=Shutter(exposure_s=0.01, row_s=30e-6),
        sensor=Sensor(electrons=2000.0),
        rig=Rig(phase_s=0.0234, toe_in_deg=3.5),
        given_scale=1.02,
        seed=74,
    ),
    "splay, flapping": Clip(
        Play(
            "HandSplay-110fps",
            Carried("flap", 28.0, 0.9),
            0.5,
            0.1,
            0.5,
            distance_m=0.53,
            at=(0.03, 0.02),
        ),
        build=Build(1.03, 0.99),
        job=Job((12.0, 17.0), 0.9, skin=(0.38, 0.21, 0.15), seed=75),
        light=WINDOW,
        shutter=Shutter(exposure_s=0.005, row_s=28e-6),
        sensor=Sensor(white=(1.03, 0.97)),
        rig=Rig(phase_s=0.0152, baseline_m=0.092),
        given_scale=0.98,
        seed=75,
    ),
}
