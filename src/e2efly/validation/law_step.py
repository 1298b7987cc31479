"""What a law of the stress (`e2efly.validation.stress_laws`) does to a flight from one control step to the next.

The training simulator computes it with JAX for n flights at once, and a plant with NumPy for one flight: the same
functions, in the library of the motion's arrays. Imports no JAX.
"""

import dataclasses
import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from e2efly.control.vectors import Quat, Vec3, namespace
from e2efly.vehicles.gravity import GRAVITY

ROUGHNESS, MAST = 0.15 * 0.3048, 20 * 0.3048
"""Roughness of the ground, and height at which the wind has its full speed, m (0.15 and 20 ft, MIL-F-8785C)."""
SHARES = (0.5, 1.5)
"""Smallest and largest factor on the thrust by the air that flows through the rotors."""
BODY = ("thrust_map", "motor_time_constant_down", "gyro_time_constant")
"""Fields of the vehicle that a law may change for a whole flight."""


@dataclass(frozen=True)
class LawStep:
    """The numbers of a control step. Their shapes are (n, ...) for n flights and (...) for one flight.

    Of a whole flight, each has a leading axis of its control steps.
    """

    lag: Any
    """(4,) time constants of the low-passes of the observed position, velocity, attitude and body rate, s."""
    error: Any
    """(12,) added to what is observed: position, m; velocity, m/s; half of a small rotation about the body axes, rad;
    body rate, rad/s."""
    heading: Any
    """() rotation of the observed attitude about the vertical, rad."""
    heading_by_load: Any
    """() the same, for each weight that the thrust exceeds the vehicle's weight by, rad."""
    stretch: Any
    """() relative error of distances from the world's origin."""
    velocity_age: Any
    """() age of the observed velocity, s."""
    derived: Any
    """() 1: the observed velocity is the difference of the last two observed positions. 0: it is measured."""
    grain: Any
    """(4,) steps in which position, m, velocity, m/s, quaternion and body rate, rad/s, are observed. 0: none."""
    held: Any
    """() 1: the last pose and velocity are shown again. 0: they are new. The body rates go on."""
    play: Any
    """() change of an action, in [-1, 1], up to which it has no effect."""
    command_grain: Any
    """() steps in which actions, in [-1, 1], are sent. 0: none."""
    lost: Any
    """() 1: the command is lost, and the last one that arrived goes on. 0: it is sent."""
    later: Any
    """() time added to the latency from observation to command, s."""
    wind: Any
    """(3,) wind at full height, world, m/s."""
    shear: Any
    """() 1: the wind falls towards the ground by a logarithm. 0: it is the same at all heights."""
    inflow: Any
    """() share of the thrust that is lost for each m/s of air that flows down through the rotors, s/m."""
    cushion: Any
    """() radius of a rotor that alone has the ground effect of all four, m. 0: there is none."""
    share: Any
    """(4,) factor on the thrust of each rotor."""
    ceiling: Any
    """() factor on the largest thrust of the rotors, at most 1."""
    mass: Any
    """() factor on the mass."""
    shift: Any
    """(2,) offset of the centre of mass in the plane of the rotors, m."""
    thrust_map: Any
    """(3,) as in `Vehicle`, and so the others."""
    motor_time_constant_down: Any
    gyro_time_constant: Any

    def at(self, step: int) -> "LawStep":
        """A control step of whole flights. The last one is repeated."""
        return LawStep(**{name: x[min(step, len(x) - 1)] for name, x in vars(self).items()})

    def of(self, flight: int) -> "LawStep":
        """A whole flight of several."""
        return LawStep(**{name: x[:, flight] for name, x in vars(self).items()})

    @property
    def disturbs(self) -> bool:
        """Whether there is wind, or another thrust than the vehicle's."""
        return bool(any(np.any(x) for x in (self.wind, self.share != 1, self.inflow, self.cushion)))


@dataclass(frozen=True)
class LawMemory:
    """What a law remembers from one control step to the next."""

    smooth: tuple[Any, Any, Any, Any]
    """The last low-passed position, velocity, quaternion and body rate."""
    velocity: Any
    """(..., k, 3) the last true velocities, newest first, m/s."""
    position: Any
    """(..., 3) the last position with its errors, m."""
    shown: tuple[Any, Any, Any, Any]
    """The last position, velocity, quaternion and body rate that were observed."""
    acting: Any
    """(..., 4) the last action that arrived."""

    @staticmethod
    def of(motion: Any, acting: Any, period: float, oldest: float) -> "LawMemory":
        """The memory before the first control step, for velocities that are at most `oldest` s old."""
        p, v = motion.position, motion.velocity
        past = namespace(v).stack([v] * (math.ceil(oldest / period - 1e-6) + 1), axis=-2)
        known = (p, v, motion.quaternion, motion.body_rate)
        return LawMemory(known, past, p - v * period, known, acting)


def observed(law: LawStep, memory: LawMemory, motion: Any, period: float) -> tuple[Any, LawMemory]:
    """The motion that is observed, and the memory after it.

    Args:
        law: the control step.
        memory: the memory of the step before.
        motion: the motion without the law, with `position`, `velocity`, `quaternion`, `body_rate` in the world and body
            frames of a state.
        period: the control period, s.
    """
    xp, error = namespace(motion.position, law.error), law.error
    past = xp.concatenate([motion.velocity[..., None, :], memory.velocity[..., :-1, :]], axis=-2)
    weight = xp.maximum(1 - abs(law.velocity_age[..., None] / period - xp.arange(past.shape[-2])), 0)
    now = motion.position, xp.sum(weight[..., None] * past, axis=-2), motion.quaternion, motion.body_rate
    at, speed, turned, rate = smooth = tuple(
        _low_passed(law.lag[..., i], before, x, period)
        for i, (before, x) in enumerate(zip(memory.smooth, now, strict=True))
    )
    position = at * (1 + law.stretch[..., None]) + error[..., 0:3]
    differences = (position - memory.position) / period
    velocity = _chosen(law.derived, differences, speed) + error[..., 3:6]
    pull = Vec3.of((motion.velocity - memory.velocity[..., 0, :]) / period + np.array([0.0, 0.0, GRAVITY], np.float32))
    half = (law.heading + law.heading_by_load * (pull.norm() / GRAVITY - 1)) / 2
    nothing = xp.zeros_like(half)
    small = Quat(xp.ones_like(half), *(error[..., i] for i in (6, 7, 8))).normalized()
    attitude = Quat(xp.cos(half), nothing, nothing, xp.sin(half)).compose(Quat.of(turned)).compose(small)
    seen = (position, velocity, attitude.stack(), rate + error[..., 9:12])
    p, v, q, w = (_coarse(x, law.grain[..., i]) for i, x in enumerate(seen))
    whole = Quat.of(q).normalized().stack()
    q = _chosen(law.grain[..., 2] > 0, whole, q)
    p, v, q = (_chosen(law.held, *pair) for pair in zip(memory.shown[:3], (p, v, q), strict=True))
    shown = dataclasses.replace(motion, position=p, velocity=v, quaternion=q, body_rate=w)
    return shown, dataclasses.replace(memory, smooth=smooth, velocity=past, position=position, shown=(p, v, q, w))


def arrived(law: LawStep, memory: LawMemory, action: Any) -> tuple[Any, LawMemory]:
    """The action that arrives of one that is sent, (..., 4) in [-1, 1], and the memory after it."""
    xp, play = namespace(action, memory.acting), law.play[..., None]
    asked = xp.clip(action, -1, 1)
    moved = _coarse(xp.clip(memory.acting, asked - play, asked + play), law.command_grain)
    acting = _chosen(law.lost, memory.acting, moved)
    return acting, dataclasses.replace(memory, acting=acting)


def air_of(law: LawStep, motion: Any) -> tuple[Any, Any]:
    """The wind, (..., 3) world, m/s, and the factors on the thrust of the rotors, (..., 4), at the true motion.

    The wind falls towards the ground as in MIL-F-8785C. The thrust near the ground is that of Cheeseman and
    Bennett (1955): 1 / (1 - (R / 4z)^2) at the height z, at least the radius R.
    """
    xp, height = namespace(motion.position, law.wind), motion.position[..., 2]
    profile = xp.log(xp.maximum(height, ROUGHNESS) / ROUGHNESS) / math.log(MAST / ROUGHNESS)
    wind = law.wind * (1 + law.shear * (profile - 1))[..., None]
    through = Quat.of(motion.quaternion).unrotate(Vec3.of(motion.velocity - wind)).z
    # a rotor that climbs meets air that flows down through it
    lost = xp.clip(1 - law.inflow * through, *SHARES)
    near = law.cushion / (4 * xp.maximum(height, xp.maximum(law.cushion, 1e-3)))
    return wind, law.share * (lost / (1 - near**2))[..., None]


def _low_passed(lag: Any, before: Any, now: Any, dt: float) -> Any:
    """A value of a first-order low-pass, (..., m), that meets `now` for `dt` s. Quaternions have length 1."""
    xp = namespace(lag, now)
    kept = xp.exp(-dt / xp.maximum(lag, 1e-6))[..., None]
    if now.shape[-1] != 4:
        return now + kept * (before - now)
    same = xp.sum(before * now, axis=-1, keepdims=True) >= 0
    mixed = Quat.of(now + kept * (xp.where(same, before, -before) - now)).normalized()
    return _chosen(lag, mixed.stack(), now)


def _chosen(which: Any, yes: Any, no: Any) -> Any:
    """`yes` where `which`, (...), is 1 or true, else `no`, (..., m)."""
    return namespace(yes, no, which).where(which[..., None] > 0, yes, no)


def _coarse(x: Any, step: Any) -> Any:
    """(..., m) rounded to multiples of `step`, (...), where that is above 0."""
    xp, size = namespace(x, step), step[..., None]
    return xp.where(size > 0, xp.round(x / xp.where(size > 0, size, 1)) * size, x)
