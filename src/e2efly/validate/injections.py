"""Faults with parameters that may strike together: each alters poses, accelerometer, link, receiver or body."""

import dataclasses
import math
import struct
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from e2efly.control.vectors import Quat
from e2efly.deploy.msp.messages import RawImu
from e2efly.deploy.odometry import Sample
from e2efly.validate.sitl import FirmwareState
from e2efly.validate.stage import Stage

HALF = math.sqrt(0.5)
_NED = Quat(0.0, HALF, HALF, 0.0)
"""From east north up to north east down."""
_FRD = Quat(0.0, 1.0, 0.0, 0.0)
"""From forward left up to forward right down."""
AXES = {"x": 0, "y": 1, "z": 2}
COUNTS = 256
"""Of the firmware's accelerometer for one gravity."""

Parameters = dict[str, Any]


def _nothing() -> None:
    """What an injection does that is done by its alterations alone."""


@dataclass(frozen=True)
class Injection:
    """One fault at work. What it alters goes through those that began before it first."""

    pose: Callable[[Sample], Sample | None] | None = None
    """A sample of the pose source, or none."""
    told: Callable[[np.ndarray], np.ndarray] | None = None
    """(3,) specific force that the controller reports, gravities."""
    felt: Callable[[FirmwareState], FirmwareState] | None = None
    """What the controller's own sensors feel."""
    each: Callable[[], None] = _nothing
    """Done before each control step."""
    end: Callable[[], None] = _nothing
    """Done when it is over."""


@dataclass(frozen=True)
class Kind:
    """A kind of fault."""

    begin: Callable[..., Injection]
    """(stage, **parameters) -> what is at work from now on."""
    draw: Callable[[np.random.Generator], Parameters] = lambda random: {}
    """Parameters by chance."""
    beyond: str = ""
    """Why nothing on the companion computer can help while it lasts; empty: the bridge is to cope with it."""
    limited: tuple[float, float] | None = None
    """Shortest and longest time that it lasts, s; None: it stays."""


def _poses(factory: Callable[..., Callable[[Sample], Sample | None]]) -> Callable[..., Injection]:
    """A kind's beginning, of a function of parameters that needs nothing of the stage."""
    return lambda stage, **parameters: Injection(pose=factory(**parameters))


def _slow(rate: float) -> Callable[[Sample], Sample | None]:
    passed = -math.inf

    def thinned(sample: Sample) -> Sample | None:
        nonlocal passed
        if sample.received < passed + 1 / rate - 1e-6:
            return None
        passed = sample.received
        return sample

    return thinned


def _gaps(gap: float, period: float) -> Callable[[Sample], Sample | None]:
    return lambda sample: None if sample.received % period < gap else sample


def _none() -> Callable[[Sample], Sample | None]:
    return lambda sample: None


def _moved(sample: Sample, turn: Callable[[np.ndarray], np.ndarray], **changes: Any) -> Sample:
    """Position and velocity turned alike."""
    velocity = None if sample.velocity is None else turn(sample.velocity)
    return dataclasses.replace(sample, position=turn(sample.position), velocity=velocity, **changes)


def _array(q: Quat) -> np.ndarray:
    return np.array([q.w, q.x, q.y, q.z], float)


def mirrored(axis: str) -> Callable[[Sample], Sample]:
    """One axis of position and velocity, or the heading, with the wrong sign; attitude and the rest as they are."""
    if axis == "yaw":

        def turned_back(sample: Sample) -> Sample:
            w, x, y, z = sample.quaternion
            yaw = math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
            back = Quat(math.cos(yaw), 0.0, 0.0, -math.sin(yaw))
            return dataclasses.replace(sample, quaternion=_array(back.compose(Quat(w, x, y, z))))

        return turned_back
    signs = np.where(np.arange(3) == AXES[axis], -1.0, 1.0)
    return lambda sample: _moved(sample, lambda v: v * signs)


def north_east_down() -> Callable[[Sample], Sample]:
    """World north east down, body forward right down."""

    def turned(sample: Sample) -> Sample:
        quaternion = _array(_NED.compose(Quat(*sample.quaternion)).compose(_FRD))
        rate = None if sample.body_rate is None else sample.body_rate * (1, -1, -1)
        return _moved(sample, lambda v: np.array([v[1], v[0], -v[2]]), quaternion=quaternion, body_rate=rate)

    return turned


def scalar_last() -> Callable[[Sample], Sample]:
    """The quaternion's numbers as x, y, z, w."""
    return lambda sample: dataclasses.replace(sample, quaternion=np.roll(sample.quaternion, -1))


def conjugated() -> Callable[[Sample], Sample]:
    """The attitude from world to body."""
    return lambda sample: dataclasses.replace(sample, quaternion=sample.quaternion * (1, -1, -1, -1))


def _scaled(factor: float) -> Callable[[Sample], Sample]:
    return lambda sample: _moved(sample, lambda v: v * factor)


def velocity_as(how: str) -> Callable[[Sample], Sample]:
    """Velocity negated or zero; absent: neither velocity nor body rate."""

    def changed(sample: Sample) -> Sample:
        if how == "absent" or sample.velocity is None:
            return dataclasses.replace(sample, velocity=None, body_rate=None)
        return dataclasses.replace(sample, velocity=sample.velocity * {"negated": -1.0, "zero": 0.0}[how])

    return changed


def _drifting(stage: Stage, speed: list[float], told: bool) -> Injection:
    """The position runs away, m/s; `told`: the velocity says so, too."""
    began, v = stage.rig.now(), np.array(speed)

    def run_away(sample: Sample) -> Sample:
        velocity = sample.velocity + v if told and sample.velocity is not None else sample.velocity
        position = sample.position + v * (sample.received - began)
        return dataclasses.replace(sample, position=position, velocity=velocity)

    return Injection(pose=run_away)


def _elsewhere(offset: list[float], yaw: float) -> Callable[[Sample], Sample]:
    """The source starts again: another origin, other axes, its clock at zero."""
    turn, c, s, first = Quat(math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2)), math.cos(yaw), math.sin(yaw), math.nan

    def restarted(sample: Sample) -> Sample:
        nonlocal first
        stamp = sample.stamp if sample.stamp is not None else sample.received
        first = stamp if math.isnan(first) else first
        quaternion = _array(turn.compose(Quat(*sample.quaternion)))
        turned = _moved(sample, lambda v: np.array([c * v[0] - s * v[1], s * v[0] + c * v[1], v[2]]))
        position = turned.position + np.array(offset)
        return dataclasses.replace(turned, position=position, quaternion=quaternion, stamp=stamp - first)

    return restarted


def _noisy(stage: Stage, position: float, velocity: float, attitude: float) -> Injection:
    """Standard deviations, m, m/s, rad."""
    random = stage.random

    def shaken(sample: Sample) -> Sample:
        quaternion = sample.quaternion + attitude / 2 * random.normal(size=4)
        v = None if sample.velocity is None else sample.velocity + velocity * random.normal(size=3)
        return dataclasses.replace(
            sample, position=sample.position + position * random.normal(size=3), velocity=v,
            quaternion=quaternion / np.linalg.norm(quaternion),
        )  # fmt: skip

    return Injection(pose=shaken)


def _pose_delay(stage: Stage, delay: float) -> Injection:
    poses = stage.poses
    poses.delay = delay
    return Injection(end=lambda: setattr(poses, "delay", 0.0))


def _told_scaled(stage: Stage, factor: float) -> Injection:
    del stage
    return Injection(told=lambda force: force * (1.0, 1.0, factor))


def _told_biased(stage: Stage, bias: list[float]) -> Injection:
    del stage
    return Injection(told=lambda force: force + np.array(bias))


def _told_frozen(stage: Stage) -> Injection:
    del stage
    kept: list[np.ndarray] = []

    def same(force: np.ndarray) -> np.ndarray:
        kept.append(force)
        del kept[1:]
        return kept[0]

    return Injection(told=same)


def _felt_scaled(stage: Stage, factor: float) -> Injection:
    del stage
    return Injection(felt=lambda s: dataclasses.replace(s, specific_force=s.specific_force * (1.0, 1.0, factor)))


def _felt_biased(stage: Stage, bias: list[float]) -> Injection:
    del stage
    push = 9.81 * np.array(bias)
    return Injection(felt=lambda s: dataclasses.replace(s, specific_force=s.specific_force + push))


def _link(name: str, healed: float | bool) -> Callable[..., Injection]:
    """An attribute of the link for a while."""

    def begin(stage: Stage, value: float | bool = True) -> Injection:
        link = stage.link
        setattr(link, name, value)
        return Injection(end=lambda: setattr(link, name, healed))

    return begin


def _receiver(stage: Stage) -> Injection:
    rig = stage.rig
    rig.heard = False
    return Injection(end=lambda: setattr(rig, "heard", True))


def _sag(stage: Stage, share: float, within: float) -> Injection:
    """All motors fall to a share of their output, s."""
    rig, began = stage.rig, stage.rig.now()
    before = rig.shares

    def fall() -> None:
        rig.shares = before * (1 - (1 - share) * min((rig.now() - began) / within, 1.0))

    return Injection(each=fall)


def _weak_motor(stage: Stage, motor: int, share: float) -> Injection:
    rig = stage.rig
    rig.shares = np.where(np.arange(4) == motor, share, 1.0) * rig.shares
    return Injection()


def _reboot(stage: Stage) -> Injection:
    stage.rig.power(False)
    return Injection(end=lambda: stage.rig.power(True))


def _uniform(low: float, high: float, name: str, digits: int = 3) -> Callable[[np.random.Generator], Parameters]:
    return lambda random: {name: round(float(random.uniform(low, high)), digits)}


def _one_of(name: str, *values: Any) -> Callable[[np.random.Generator], Parameters]:
    return lambda random: {name: values[int(random.integers(len(values)))]}


def _vector(random: np.random.Generator, length: float, digits: int = 3) -> list[float]:
    way = random.normal(size=3)
    return [round(float(x), digits) for x in length * way / np.linalg.norm(way)]


HELD = "the firmware holds the last command while the link is silent"
NO_POWER = "the controller has no power, and starts disarmed"
KINDS = {
    "poses: slow": Kind(_poses(_slow), _one_of("rate", 3, 5, 8, 10, 15, 20, 30)),
    "poses: gaps": Kind(_poses(_gaps), lambda random: {
        "gap": round(float(random.uniform(0.05, 0.3)), 3), "period": round(float(random.uniform(0.35, 2.0)), 3)}),
    "poses: none": Kind(_poses(_none)),
    "poses: late": Kind(_pose_delay, _uniform(0.05, 0.3, "delay")),
    "poses: mirrored": Kind(_poses(mirrored), _one_of("axis", "x", "y", "z", "yaw")),
    "poses: NED and FRD": Kind(_poses(north_east_down)),
    "poses: quaternion xyzw": Kind(_poses(scalar_last)),
    "poses: quaternion conjugated": Kind(_poses(conjugated)),
    "poses: scaled": Kind(_poses(_scaled), _one_of("factor", 0.01, 0.3, 0.5, 0.8, 0.9, 1.1, 1.25, 2.0, 3.28)),
    "poses: drifting": Kind(_drifting, lambda random: {
        "speed": _vector(random, random.uniform(0.05, 1.0)), "told": bool(random.random() < 0.5)}),
    "poses: another origin": Kind(_poses(_elsewhere), lambda random: {
        "offset": _vector(random, random.uniform(0.1, 3.0)), "yaw": round(float(random.uniform(-3.1, 3.1)), 3)}),
    "poses: velocity": Kind(_poses(velocity_as), _one_of("how", "negated", "zero", "absent")),
    "poses: noisy": Kind(_noisy, lambda random: {
        "position": round(float(random.uniform(0.002, 0.03)), 4),
        "velocity": round(float(random.uniform(0.02, 0.3)), 3),
        "attitude": round(float(random.uniform(0.005, 0.06)), 4)}),
    "accelerometer as told: z scaled": Kind(
        _told_scaled, _one_of("factor", -1.0, 0.0, 0.9, 0.93, 0.95, 0.97, 0.98, 1.03, 1.05, 1.1, 1.15)),
    "accelerometer as told: biased": Kind(
        _told_biased, lambda random: {"bias": _vector(random, random.uniform(0.01, 0.1))}),
    "accelerometer as told: frozen": Kind(_told_frozen),
    "accelerometer: z scaled": Kind(_felt_scaled, _uniform(0.9, 1.1, "factor")),
    "accelerometer: biased": Kind(_felt_biased, lambda random: {"bias": _vector(random, random.uniform(0.01, 0.08))}),
    "link: silent": Kind(_link("silent", False), beyond=HELD, limited=(0.1, 5.0)),
    "link: garbage": Kind(_link("garbage", 0.0), _uniform(0.1, 0.9, "value"), limited=(0.5, 10.0)),
    "link: spoilt": Kind(_link("spoilt", 0.0), _uniform(0.1, 1.0, "value"), limited=(0.5, 10.0)),
    "link: late": Kind(_link("delay", 0.0), _uniform(0.01, 0.1, "value"), limited=(0.5, 10.0)),
    "receiver: silent": Kind(_receiver, limited=(0.1, 5.0)),
    "battery: sag": Kind(_sag, lambda random: {
        "share": round(float(random.uniform(0.75, 0.95)), 3), "within": round(float(random.uniform(0.1, 5.0)), 2)}),
    "motor: weak": Kind(_weak_motor, lambda random: {
        "motor": int(random.integers(4)), "share": round(float(random.uniform(0.8, 0.97)), 3)}),
    "controller: reboots": Kind(_reboot, beyond=NO_POWER, limited=(0.5, 2.0)),
}  # fmt: skip
"""All kinds, by name."""


@dataclass(frozen=True)
class Strike:
    """One fault of a flight: plain data."""

    kind: str
    """One of `KINDS`."""
    at: float = 0.0
    """When it begins after the flight has come to its mode, s; on the ground 0 is before the bridge was started."""
    lasts: float | None = None
    """How long, s; None: to the end."""
    parameters: Parameters = dataclasses.field(default_factory=dict)
    """Of its kind."""

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise ValueError(f"kind is {self.kind!r}; accepted: {', '.join(KINDS)}")


class Faults:
    """Those at work on a stage. Call `each` before every control step."""

    def __init__(self, stage: Stage) -> None:
        self._stage = stage
        self._active: list[tuple[float, Injection]] = []

    def attach(self) -> None:
        """To the stage's present link, poses and rig."""
        self._stage.poses.alter = self._pose
        self._stage.link.rewrites[RawImu.CODE] = self._imu
        self._stage.rig.felt = self._felt

    def begin(self, strike: Strike) -> None:
        """Let a fault begin."""
        ends = math.inf if strike.lasts is None else self._stage.rig.now() + strike.lasts
        self._active.append((ends, KINDS[strike.kind].begin(self._stage, **strike.parameters)))

    def each(self) -> None:
        """Go on with all of them, and end those that are over."""
        now = self._stage.rig.now()
        for ends, injection in self._active:
            (injection.each if now < ends else injection.end)()
        self._active = [(ends, injection) for ends, injection in self._active if now < ends]

    def _pose(self, sample: Sample) -> Sample | None:
        altered: Sample | None = sample
        for _, injection in self._active:
            if altered is not None and injection.pose is not None:
                altered = injection.pose(altered)
        return altered

    def _imu(self, payload: bytes) -> bytes:
        *counts, gx, gy, gz = struct.unpack("<6h", payload[:12])
        force = np.array(counts) / COUNTS
        for _, injection in self._active:
            force = force if injection.told is None else injection.told(force)
        counts = np.clip(np.round(force * COUNTS), -32768, 32767).astype(int).tolist()
        return struct.pack("<6h", *counts, gx, gy, gz) + payload[12:]

    def _felt(self, state: FirmwareState) -> FirmwareState:
        for _, injection in self._active:
            state = state if injection.felt is None else injection.felt(state)
        return state
