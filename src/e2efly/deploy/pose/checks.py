"""What a sample of a pose source must satisfy before anything flies by it."""

import math
from dataclasses import dataclass, fields

REASONS = {
    "malformed": "an array has the wrong shape",
    "not_finite": "a number is NaN, infinite or absurdly large",
    "quaternion": "the length of the quaternion is not 1",
    "frame": "the frame is not the one that is expected",
    "order": "it is not later than the sample before",
    "clock": "the source's clock jumped; the next samples are mapped anew",
    "late": "it took too long to arrive",
    "speed": "its velocity or body rate is beyond what is possible",
    "jump": "the pose jumped; one outlier passes, a lasting jump stays a fault",
    "frozen": "the pose repeats bit for bit although new samples come",
    "velocity": "its velocity disagrees with how its position changes",
    "starting": "too few samples for an estimate of velocity or body rate",
}
"""First word of each reason, before a colon, and what it means."""


@dataclass(frozen=True)
class Checks:
    """What a sample must satisfy, and how motion is estimated."""

    frame: str = ""
    """Name of the frame that samples must carry; empty: any."""
    max_age: float = 0.1
    """Longest time from true to arrived, beyond the shortest of the source, s."""
    latency: float = 0.0
    """Shortest time from true to arrived, s, as the source's data sheet says: no clock mapping can see it."""
    clock_jump: float = 0.05
    """Steps of the source's clock larger than this are reported, s."""
    out_of_order: str = "refuse"
    """What to say of samples that are not later than the one before: "refuse" gives a reason, "ignore" none."""
    quaternion_tolerance: float = 0.01
    """How far the length of the quaternion may be from 1; within, it is normalised."""
    jump_position: float = 0.05
    """Step of the position that is allowed between any two samples, m, added to `jump_speed` times their interval."""
    jump_speed: float = 15.0
    """Largest speed, m/s."""
    jump_attitude: float = 0.2
    """Step of the attitude that is allowed between any two samples, rad, added to `jump_rate` times their interval."""
    jump_rate: float = 35.0
    """Largest body rate, rad/s."""
    jump_count: int = 3
    """Successive samples at a place that was jumped to after which the jump stays a fault."""
    frozen_after: float = 0.2
    """How long the pose may repeat bit for bit, s; infinite for a source without noise."""
    velocity_cutoff: float = 15.0
    """Corner of the low-pass of the estimated velocity, Hz; its delay is 1 / (pi * cutoff), 21 ms at 15 Hz."""
    rate_cutoff: float = 30.0
    """Corner of the low-pass of the estimated body rate, Hz; its delay is 1 / (pi * cutoff), 11 ms at 30 Hz."""
    velocity_mismatch: float = 2.0
    """Largest difference between the velocity that the source gives and the one estimated from its positions, m/s,
    added to 0.3 times the speed: larger when a source leaves its velocity at zero or gives it in another frame."""
    velocity_drift: float = 0.08
    """How far, within half a second, the velocity that the source gives may lead away from its positions, m ..."""
    velocity_share: float = 0.3
    """... and share of the way that is added to it."""
    gap: float = 0.5
    """After a pause longer than this the estimates of velocity and body rate start anew, s."""

    def __post_init__(self) -> None:
        for name in (f.name for f in fields(self)):
            value = getattr(self, name)
            if name == "frame":
                good, accepted = isinstance(value, str), "a text"
            elif name == "out_of_order":
                good, accepted = value in ("refuse", "ignore"), "'refuse' or 'ignore'"
            elif name == "jump_count":
                good, accepted = type(value) is int and value >= 1, "a whole number, 1 or more"
            elif name in ("latency", "jump_position", "jump_attitude"):
                good, accepted = _number(value) and 0 <= value < math.inf, "a finite number, 0 or more"
            elif name == "frozen_after":
                good, accepted = _number(value) and value > 0, "a positive number, or infinity"
            else:
                good, accepted = _number(value) and 0 < value < math.inf, "a positive finite number"
            if not good:
                raise ValueError(f"checks: {name} is {value!r}; accepted: {accepted}")


def _number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and not math.isnan(value)
