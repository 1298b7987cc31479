"""Pose sources that are wrong: slow, late, in other axes, of another origin, without velocity."""

import dataclasses
import math
from collections.abc import Callable
from typing import Any

import numpy as np

from e2efly.control.vectors import Quat
from e2efly.policy.odometry import Sample
from tests.faults.injection import Injection, Kind, held, one_of, uniform, vector
from tests.faults.stage import Stage

HALF = math.sqrt(0.5)
_NED = Quat(0.0, HALF, HALF, 0.0)
"""From east north up to north east down."""
_FRD = Quat(0.0, 1.0, 0.0, 0.0)
"""From forward left up to forward right down."""
AXES = {"x": 0, "y": 1, "z": 2}


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
            attitude = Quat.of(sample.quaternion)
            back = Quat(math.cos(attitude.yaw()), 0.0, 0.0, -math.sin(attitude.yaw()))
            return dataclasses.replace(sample, quaternion=_array(back.compose(attitude)))

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


def stepped(step: float) -> Callable[[Sample], Sample]:
    """The source's clock is set, s."""
    return lambda sample: sample if sample.stamp is None else dataclasses.replace(sample, stamp=sample.stamp + step)


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


POSES = {
    "poses: slow": Kind(_poses(_slow), one_of("rate", 3, 5, 8, 10, 15, 20, 30)),
    "poses: gaps": Kind(_poses(_gaps), uniform(gap=(0.05, 0.3), period=(0.35, 2.0))),
    "poses: none": Kind(lambda stage: Injection(pose=lambda sample: None)),
    "poses: late": Kind(held("poses", "delay", 0.0), uniform(delay=(0.05, 0.3))),
    "poses: mirrored": Kind(_poses(mirrored), one_of("axis", "x", "y", "z", "yaw")),
    "poses: NED and FRD": Kind(_poses(north_east_down)),
    "poses: quaternion xyzw": Kind(_poses(scalar_last)),
    "poses: quaternion conjugated": Kind(_poses(conjugated)),
    "poses: scaled": Kind(_poses(_scaled), one_of("factor", 0.01, 0.3, 0.5, 0.8, 0.9, 1.1, 1.25, 2.0, 3.28)),
    "poses: drifting": Kind(_drifting, lambda random: {
        "speed": vector(random, random.uniform(0.05, 1.0)), "told": bool(random.random() < 0.5)}),
    "poses: another origin": Kind(_poses(_elsewhere), lambda random: {
        "offset": vector(random, random.uniform(0.1, 3.0)), "yaw": round(float(random.uniform(-3.1, 3.1)), 3)}),
    "poses: velocity": Kind(_poses(velocity_as), one_of("how", "negated", "zero", "absent")),
    "poses: noisy": Kind(_noisy, lambda random: {
        "position": round(float(random.uniform(0.002, 0.03)), 4),
        "velocity": round(float(random.uniform(0.02, 0.3)), 3),
        "attitude": round(float(random.uniform(0.005, 0.06)), 4)}),
}  # fmt: skip
"""Kinds of faults of the pose source, by name."""
