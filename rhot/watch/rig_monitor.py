"""Health beats and liveliness tokens of a rig, gathered into a RigState.

A service whose beat is missing for three seconds is `silent`, one whose token is gone is `gone`,
one that rig.toml expects and that never came is `absent`; `alive` is one whose first beat is waited
for. Pure: time is an argument. Nothing from
the network makes it grow without bound.
"""

from __future__ import annotations

from collections.abc import Iterable

from rhot import topics
from rhot.files.config import RigConfig
from rhot.messages.health import Health
from rhot.watch.ages import ages_of
from rhot.watch.object_watch import ObjectWatch
from rhot.watch.onlooker_faults import missing_services, router_lost
from rhot.watch.rig_state import CameraRow, RigState, ServiceRow, StandingFault

# Three beats: one may be late, two may be lost.
_SILENT_NS = 3_000_000_000
# Tokens of those who are there come at once, also through a busy router.
_TOKENS_NS = 1_000_000_000
# A last beat may come after the news that its sender has gone; one that starts anew beats later.
_LATE_NS = 500_000_000
# A rig of two Pis has eight services.
_MAX_SERVICES = 64


def expected_services(config: RigConfig) -> list[tuple[str, str]]:
    """(service, instance) of all that rig.toml calls for, without viewer and recorder."""
    expected = [("pi_tracker", camera.name) for camera in config.camera]
    # Markers alone are no pose: nothing is solved.
    expected += [(name, "main") for name in ("fusion", "solver")[: 1 + config.has_depth]]
    if any(camera.source == "simulator" for camera in config.camera):
        expected.insert(0, ("simulator", "main"))
    if config.object and config.objects.source == "steamvr":
        expected.append(("openvr_bridge", bridge_instance(config)))
    return expected + ([("object_tracker", "main")] if config.object else [])


def bridge_instance(config: RigConfig) -> str:
    """What rhot-openvr-bridge is called: on a machine of its own as its certificate is."""
    sources = config.bus.object_sources
    return sources[0] if config.objects.host and sources else "main"


class RigMonitor:
    """What has been heard of a rig since now_ns, when the onlooker began to listen."""

    def __init__(self, config: RigConfig, now_ns: int) -> None:
        self._config = config
        self._expected = expected_services(config)
        self._since_ns = now_ns
        # By (service, instance): whether its token is there and since when; its newest beat.
        self._alive: dict[tuple[str, str], tuple[bool, int]] = {}
        self._beats: dict[tuple[str, str], tuple[int, Health]] = {}
        self._lost_ns: int | None = None
        # None: nobody listens to objects.
        self._objects: ObjectWatch | None = None

    def watch_objects(self) -> ObjectWatch:
        """Have objects in the state from now on; what is heard of them goes to the result."""
        self._objects = self._objects or ObjectWatch(self._config)
        return self._objects

    def token(self, service: str, instance: str, alive: bool, now_ns: int) -> None:
        """A service came or went."""
        if self._has_room((service, instance)):
            self._alive[service, instance] = (alive, now_ns)

    def beat(self, health: Health, now_ns: int) -> None:
        """A service's health arrived."""
        if self._has_room((health.service, health.instance)):
            self._beats[health.service, health.instance] = (now_ns, health)

    def connected(self, connected: bool, now_ns: int) -> None:
        """Whether the router answers: without it nothing is known of anybody."""
        if connected:
            self._lost_ns = None
        elif self._lost_ns is None:
            self._lost_ns = now_ns

    def state(self, now_ns: int) -> RigState:
        """The rig as it stands: the expected services first, then the others by name."""
        names = dict.fromkeys([*self._expected, *sorted({*self._alive, *self._beats})])
        rows = [self._row(service, instance, now_ns) for service, instance in names]
        beats = [row.health for row in rows if row.health is not None and row.state != "silent"]
        ages = ages_of(beats)
        return RigState(
            rig=self._config.rig.name,
            stamp_ns=now_ns,
            connection="ok" if self._lost_ns is None else "lost",
            services=rows,
            faults=self._faults(rows, now_ns),
            cameras=[self._camera(camera.name, beats) for camera in self._config.camera],
            ages=ages,
            glass_to_pose_ms={one.hand: (one.pose_ms, one.pose_p99_ms) for one in ages},
            objects=self._objects.rows(now_ns) if self._objects is not None else [],
        )

    def _has_room(self, name: tuple[str, str]) -> bool:
        known = {*self._alive, *self._beats}
        return name in known or name in self._expected or len(known) < _MAX_SERVICES

    def _row(self, service: str, instance: str, now_ns: int) -> ServiceRow:
        name = (service, instance)
        beat_ns, health = self._beats.get(name, (0, None))
        alive, token_ns = self._alive.get(name, (False, 0))
        if health is None and name not in self._alive:
            state = "absent"
        elif name in self._alive and not alive and beat_ns < token_ns + _LATE_NS:
            state = "gone"
        elif now_ns - max(beat_ns, token_ns) > _SILENT_NS or (
            health is not None and now_ns - beat_ns > _SILENT_NS
        ):
            state = "silent"
        elif health is None:
            state = "alive"
        else:
            state = health.state
        return ServiceRow(
            service=service,
            instance=instance,
            state=state,
            health=health if state != "gone" else None,
            expected=name in self._expected,
            heard_ns=max(beat_ns, token_ns),
        )

    def _faults(self, rows: Iterable[ServiceRow], now_ns: int) -> list[StandingFault]:
        if self._lost_ns is not None:
            lost = router_lost(self._config.bus.connect, self._lost_ns)
            return [StandingFault(teller="", fault=lost)]
        settled = now_ns - self._since_ns >= _TOKENS_NS
        found = [
            StandingFault(teller="", fault=fault)
            for fault in missing_services(self._config, rows, self._since_ns)
            if settled or fault.code != "service_absent"
        ]
        found += [
            StandingFault(teller=row.name, fault=fault)
            for row in rows
            if row.health is not None and row.state != "silent"
            for fault in row.health.faults
        ]
        return sorted(found, key=lambda one: (one.fault.severity, one.fault.since_ns))

    def _camera(self, camera: str, beats: Iterable[Health]) -> CameraRow:
        expected_hz = self._config.camera_named(camera).fps
        markers, rate_hz = -1, 0.0
        for health in beats:
            if (health.service, health.instance) != ("pi_tracker", camera):
                continue
            for stream in health.streams:
                if stream.direction == "out" and topics.MARKERS.names(stream.key):
                    rate_hz = stream.rate_hz
            if rate_hz and 0.0 <= health.values.get("markers", -1.0) < 1e6:
                markers = int(health.values["markers"])
        return CameraRow(
            camera=camera,
            markers=markers,
            expected_markers=len(
                self._config.counted(self._config.markers_of(self._config.colors))
            ),
            rate_hz=rate_hz,
            expected_hz=expected_hz,
        )
