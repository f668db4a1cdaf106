"""Where one tracker is and how it moves, from its poses: what a hand cannot do is no pose.

Pure. Constant velocity with white-noise acceleration (position) and white-noise angular
acceleration (orientation), each with one isotropic 2 x 2 covariance, in the lighthouse frame. A
pose whose innovation is beyond the gate is an outlier and changes nothing; but poses that are
outliers to the track and agree with each other, for some samples and some time, are where the
tracker is now: the track begins there anew. All constants are per second, none per sample.
"""

from __future__ import annotations

import math

from rhot.geometry.quaternions import Quat, conjugate, from_vector, multiply, normalized, to_vector
from rhot.messages import Vec3

# Spectral density of a hand's acceleration, m^2/s^3: 20 m/s^2 (rhot's own measurements of hands:
# 8..20 m/s^2 within a frame) that last 0.05 s. A jerk of 80 m/s^2 stays within the gate at 90 Hz.
_ACCELERATION = 40.0
# The same of turns, rad^2/s^3: 200 rad/s^2 for 0.05 s. vive/libsurvive holds turns of 35 rad/s.
_TURN_ACCELERATION = 4000.0
# What rests accelerates less: below these speeds the densities fall with the speed's square, down
# to this share. The gate of a tracker at rest is 13 mm at 90 Hz then, not 35 mm, and 8 g still
# begin within it.
_BRISK_M_S, _BRISK_RAD_S, _AT_REST = 0.3, 2.0, 0.1
# Noise of a pose: SteamVR's are quoted at 0.3 mm to 1 mm and 0.2 deg.
_SIGMA_M, _SIGMA_RAD = 1e-3, 3.5e-3
# Stamps scatter: libsurvive's lines are written some milliseconds late, SteamVR's poses are of the
# last light. What moves is off by its speed times that.
_SIGMA_S = 6e-3
# A stranger's velocity at the first pose of a track.
_SIGMA_START_M_S, _SIGMA_START_RAD_S = 1.0, 15.0
# Squared length of a normalised innovation in three axes: 5 sigma.
_GATE = 25.0
# However long nothing was seen, a jump of so much wants to be seen again before it is believed.
_MOST_M, _MOST_RAD = 0.15, 0.6
# While other poses disagree with the track, only what is this near to it is its own.
_DOUBTED = 1.0 / 3.0
# Poses beside the track that agree with each other become the track after so long and so many.
_AGREE_S, _AGREE_COUNT = 0.02, 4


class Axis:
    """One isotropic constant-velocity covariance: variance of place, of both, of velocity."""

    __slots__ = ("_density", "place", "speed", "together")

    def __init__(self, density: float, sigma: float, sigma_speed: float) -> None:
        self._density = density
        self.place, self.together, self.speed = sigma * sigma, 0.0, sigma_speed * sigma_speed

    def predict(self, dt: float, share: float) -> tuple[float, float, float]:
        """The three variances dt seconds later, at a share of the full acceleration."""
        speed, together, grown = self.speed, self.together, self._density * share * dt
        return (
            self.place + dt * (2.0 * together + dt * (speed + grown / 3.0)),
            together + dt * (speed + 0.5 * grown),
            speed + grown,
        )

    def update(self, predicted: tuple[float, float, float], variance: float) -> tuple[float, float]:
        """Take in a measurement of the place with that variance; gains of place and velocity."""
        place, together, speed = predicted
        total = place + variance
        gain, gain_speed = place / total, together / total
        self.place = (1.0 - gain) * place
        self.together = (1.0 - gain) * together
        self.speed = speed - gain_speed * together
        return gain, gain_speed


class Track:
    """One hypothesis of where a tracker is: position, orientation, both velocities."""

    def __init__(self, stamp_ns: int, position_m: Vec3, orientation: Quat) -> None:
        self.stamp_ns = stamp_ns
        self.began_ns = stamp_ns
        self.count = 1
        self.position_m = position_m
        self.orientation = orientation
        self.velocity_m_s: Vec3 = (0.0, 0.0, 0.0)
        self.angular_velocity_rad_s: Vec3 = (0.0, 0.0, 0.0)
        self._place = Axis(_ACCELERATION, _SIGMA_M, _SIGMA_START_M_S)
        self._turn = Axis(_TURN_ACCELERATION, _SIGMA_RAD, _SIGMA_START_RAD_S)

    @property
    def sigma_m(self) -> float:
        """One standard deviation of the position, as the length of a vector."""
        return math.sqrt(3.0 * self._place.place)

    @property
    def sigma_rad(self) -> float:
        """One standard deviation of the orientation, as the length of a vector."""
        return math.sqrt(3.0 * self._turn.place)

    def take(self, stamp_ns: int, position_m: Vec3, orientation: Quat, most: float = 1.0) -> bool:
        """Whether a pose is within the gate, which is never wider than a share `most` of the
        widest; the track goes on with it then.
        """
        dt = (stamp_ns - self.stamp_ns) * 1e-9
        (px, py, pz), (vx, vy, vz) = self.position_m, self.velocity_m_s
        wx, wy, wz = self.angular_velocity_rad_s
        px, py, pz = px + vx * dt, py + vy * dt, pz + vz * dt
        dx, dy, dz = position_m[0] - px, position_m[1] - py, position_m[2] - pz
        late = _SIGMA_S * _SIGMA_S
        speed2 = vx * vx + vy * vy + vz * vz
        noise = _SIGMA_M * _SIGMA_M + late * speed2 / 3.0
        place = self._place.predict(dt, _share(speed2, _BRISK_M_S))
        widest = (_MOST_M * most) ** 2
        if dx * dx + dy * dy + dz * dz > min(_GATE * (place[0] + noise), widest):
            return False
        turned = multiply(from_vector(wx * dt, wy * dt, wz * dt), self.orientation)
        rx, ry, rz = to_vector(multiply(orientation, conjugate(turned)))
        spin2 = wx * wx + wy * wy + wz * wz
        turn_noise = _SIGMA_RAD * _SIGMA_RAD + late * spin2 / 3.0
        turn = self._turn.predict(dt, _share(spin2, _BRISK_RAD_S))
        widest = (_MOST_RAD * most) ** 2
        if rx * rx + ry * ry + rz * rz > min(_GATE * (turn[0] + turn_noise), widest):
            return False
        gain, speed_gain = self._place.update(place, noise)
        self.position_m = (px + gain * dx, py + gain * dy, pz + gain * dz)
        self.velocity_m_s = (vx + speed_gain * dx, vy + speed_gain * dy, vz + speed_gain * dz)
        gain, speed_gain = self._turn.update(turn, turn_noise)
        self.orientation = normalized(
            multiply(from_vector(gain * rx, gain * ry, gain * rz), turned)
        )
        self.angular_velocity_rad_s = (
            wx + speed_gain * rx,
            wy + speed_gain * ry,
            wz + speed_gain * rz,
        )
        self.stamp_ns = stamp_ns
        self.count += 1
        return True


def _share(speed2: float, brisk: float) -> float:
    return min(1.0, max(_AT_REST, speed2 / (brisk * brisk)))


class TrackKeeper:
    """The track of one device, and the candidate that may replace it."""

    def __init__(self) -> None:
        self.track: Track | None = None
        self._candidate: Track | None = None

    def forget(self) -> None:
        """The device said itself that it does not know where it is."""
        self.track = self._candidate = None

    def take(self, stamp_ns: int, position_m: Vec3, orientation: Quat) -> Track | None:
        """The track with this pose in it, or None if the pose is an outlier so far.

        Stamps rise. The first pose of all begins the track: nothing speaks against it.
        """
        track, candidate = self.track, self._candidate
        if track is None:
            self.track = track = Track(stamp_ns, position_m, orientation)
            return track
        most = 1.0 if candidate is None else _DOUBTED
        if track.take(stamp_ns, position_m, orientation, most):
            self._candidate = None
            return track
        if candidate is None or not candidate.take(stamp_ns, position_m, orientation):
            self._candidate = Track(stamp_ns, position_m, orientation)
            return None
        if candidate.count < _AGREE_COUNT or stamp_ns - candidate.began_ns < _AGREE_S * 1e9:
            return None
        self.track, self._candidate = candidate, None
        return candidate
