"""The clips, a tuning half and a held-out half: other people, motions, lights, sensors and rigs.

Pure data.
"""

from __future__ import annotations

from testing.families.case import Half
from testing.second_renderer.clip import Clip, Rig
from testing.second_renderer.motion import Carried, Play
from testing.second_renderer.paint import Job
from testing.second_renderer.pictures import Shutter
from testing.second_renderer.room import Lamp, Light
from testing.second_renderer.sensor import Sensor
from testing.second_renderer.skin import Build

_WARM = Light(
    (Lamp((0.9, -0.8, -0.2), (5.0, 4.2, 3.2)), Lamp((-0.5, 0.6, -0.4), (1.5, 1.2, 0.9))),
    (1.1, 1.0, 0.85),
)
_COLD = Light(
    (Lamp((-0.8, -0.2, -0.3), (3.4, 3.7, 4.2)), Lamp((0.3, -1.2, 0.1), (2.6, 2.7, 2.9))),
    (1.5, 1.6, 1.75),
)
_DARK, _PALE = (0.22, 0.115, 0.08), (0.72, 0.47, 0.38)

CLIPS: dict[Half, dict[str, Clip]] = {
    "tuning": {
        "splay": Clip(Play("HandSplay-110fps", speed=0.9)),
        "flapping": Clip(
            Play("wave", distance_m=0.5, tilt_deg=15.0),
            build=Build(0.93, 0.95),
            job=Job((11.0, 14.0), 0.6, skin=_DARK, seed=2),
            light=_WARM,
            sensor=Sensor(gain=1.05, white=(0.95, 1.1), electrons=1500.0),
            rig=Rig(phase_s=0.021, baseline_m=0.075, toe_in_deg=0.0),
            given_scale=0.95,
            seed=2,
        ),
        "roll, waiting": Clip(
            Play("pinch", Carried("wait", 28.0, 0.45), speed=0.5, end=0.4, scale=1.05),
            build=Build(1.08, 1.05),
            job=Job((13.0, 18.0), 1.2, dab_off_mm=4.0, skin=_PALE, seed=3),
            light=_COLD,
            sensor=Sensor(jpeg=85, sharpen=0.5),
            rig=Rig(phase_s=0.004, toe_in_deg=4.0),
            seed=3,
        ),
        "grab": Clip(
            Play("grab", speed=0.8, end=0.8, tilt_deg=10.0, distance_m=0.42),
            job=Job((12.0, 15.0), 0.8, seed=4),
            sensor=Sensor(electrons=1200.0, blur_px=0.8),
            given_scale=1.05,
            seed=4,
        ),
    },
    "held_out": {
        "splay, rolling, small": Clip(
            Play("HandSplay-110fps", Carried("roll", 20.0, 0.5), 1.0, scale=0.84, distance_m=0.4),
            build=Build(0.95, 0.95),
            job=Job((9.0, 12.0), 1.0, dab_off_mm=3.0, patchy=0.3, skin=_PALE, seed=11),
            light=_WARM,
            sensor=Sensor(jpeg=75, white=(1.05, 0.95)),
            rig=Rig(phase_s=0.0163),
            given_scale=0.9,
            seed=11,
        ),
        "flapping, far": Clip(
            Play("wave", speed=0.95, distance_m=0.58, tilt_deg=20.0, yaw_deg=12.0),
            build=Build(1.05, 1.0),
            job=Job((13.0, 16.0), 0.8, skin=(0.42, 0.23, 0.16), seed=12),
            light=_COLD,
            shutter=Shutter(exposure_s=0.006, row_s=34e-6),
            sensor=Sensor(gain=1.1, electrons=2000.0),
            rig=Rig(phase_s=0.0092, baseline_m=0.09, toe_in_deg=5.0),
            seed=12,
        ),
        "grab, drifting": Clip(
            Play("grab", Carried("drift", 60.0, 0.4), 0.6, end=0.5, distance_m=0.46),
            job=Job((10.0, 15.0), 1.0, dab_off_mm=5.0, skin=_DARK, seed=13),
            sensor=Sensor(sharpen=0.8, blur_px=0.7),
            rig=Rig(phase_s=0.0275),
            given_scale=0.95,
            seed=13,
        ),
        "pinch, waiting": Clip(
            Play("pinch", Carried("wait", 35.0, 0.35), 1.0, yaw_deg=-10.0, roll_deg=10.0),
            build=Build(0.97, 1.0),
            job=Job((12.0, 17.0), 1.5, patchy=0.25, seed=14),
            light=_WARM,
            sensor=Sensor(electrons=1500.0, jpeg=90),
            rig=Rig(phase_s=0.0065),
            given_scale=1.05,
            seed=14,
        ),
    },
}
