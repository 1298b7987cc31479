"""The conditions that a sample of a pose source must satisfy before it is used for flight."""

import math
from dataclasses import dataclass
from typing import Literal

from e2efly.config.numbers import check_fields, number

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
"""The first word of each reason, before a colon, and its meaning."""


@dataclass(frozen=True)
class Checks:
    """The conditions that a sample must satisfy, and how motion is estimated."""

    frame: str = ""
    """Name of the frame that samples must have. Empty: any frame."""
    max_age: float = number(0.1, above=0)
    """The longest delay from measurement to arrival, beyond the source's shortest delay, s."""
    latency: float = number(0.0)
    """The shortest delay from measurement to arrival, s, from the source's data sheet. No clock mapping can measure
    it."""
    clock_jump: float = number(0.05, above=0)
    """Jumps of the source's clock that are larger than this are reported, s."""
    out_of_order: Literal["refuse", "ignore"] = "refuse"
    """What to do with samples that are not later than the one before. "refuse" gives a reason, "ignore" gives none."""
    quaternion_tolerance: float = number(0.01, above=0)
    """The largest deviation of the quaternion's length from 1. Within this limit, the quaternion is normalised."""
    jump_position: float = number(0.05)
    """Position step that is allowed between any two samples, m. `jump_speed` times their interval is added to it."""
    jump_speed: float = number(15.0, above=0)
    """Largest speed, m/s."""
    jump_attitude: float = number(0.2)
    """Attitude step that is allowed between any two samples, rad. `jump_rate` times their interval is added to it."""
    jump_rate: float = number(35.0, above=0)
    """Largest body rate, rad/s."""
    jump_count: int = number(3, low=1)
    """Number of successive samples at the place of a jump after which the jump becomes a lasting fault."""
    frozen_after: float = number(0.2, above=0, endless=True)
    """How long the pose may repeat bit for bit, s. Use infinity for a source without noise."""
    velocity_cutoff: float = number(15.0, above=0)
    """Cut-off frequency of the low-pass filter of the estimated velocity, Hz."""
    rate_cutoff: float = number(30.0, above=0)
    """Cut-off frequency of the low-pass filter of the estimated body rate, Hz."""
    velocity_mismatch: float = number(2.0, above=0)
    """The largest difference between the source's velocity and the velocity estimated from its positions, m/s. 0.3
    times the speed is added to it. The difference is larger if a source leaves its velocity at zero or gives it in
    another frame."""
    velocity_drift: float = number(0.08, above=0)
    """The largest distance, m, between the path that the source's velocities give and its positions, within half a
    second. `velocity_share` of the path is added to it."""
    velocity_share: float = number(0.3, above=0)
    """The share of the path's length that is added to `velocity_drift`."""
    gap: float = number(0.5, above=0)
    """After a pause longer than this, the estimates of velocity and body rate start again, s."""

    def __post_init__(self) -> None:
        check_fields("checks", self)
        if not isinstance(self.frame, str):
            raise ValueError(f"checks.frame is {self.frame!r}; accepted: a text")

    @property
    def velocity_lag(self) -> float:
        """How late the estimated velocity is, s: 1 / (pi * cutoff), 21 ms at 15 Hz."""
        return 1 / (math.pi * self.velocity_cutoff)

    @property
    def rate_lag(self) -> float:
        """How late the estimated body rate is, s: 11 ms at 30 Hz."""
        return 1 / (math.pi * self.rate_cutoff)
