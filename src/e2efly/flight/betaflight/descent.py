"""The watchdog's descent: velocity from the controller's accelerometer and the throttle, and the ground by feeling.

It is what the bridge does without poses, as far as this needs no poses: see `pilot.reckoning` and `pilot.touch`. Plain
arithmetic, because the watchdog imports no NumPy. Pure.
"""

import math
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

from e2efly.flight.attitude import Attitude, level
from e2efly.flight.betaflight.messages import RawImu
from e2efly.flight.pilot import touch
from e2efly.flight.pilot.touch import LAGS, Touch
from e2efly.vehicles.gravity import GRAVITY

SINK, FASTER, FASTEST = 0.55, 0.2, 1.0
"""Sink speed at first, m/s, its growth, m/s^2, and the largest, m/s. It grows faster than the velocity errs, so that
the vehicle always sinks."""
GAIN, LARGEST = 3.0, 3.0
"""Acceleration divided by the error of the vertical speed, 1/s, and the largest acceleration, m/s^2."""
TRIM_GAIN, TRIM_ERROR, LARGEST_TRIM = 3.0, 0.6, 4.0
"""The rate of the trim divided by the error of the vertical speed, 1/s^2, the largest error that counts, m/s, and the
bound of the trim, m/s^2."""
BRAKE_GAIN, BRAKE, BRAKE_S = 1.5, 3.0, 2.0
"""Deceleration divided by horizontal speed, 1/s, the largest deceleration, m/s^2, and how long it is braked, s."""
STEP_S = 0.25
"""The longest step of the velocity, s. After a longer pause the horizontal velocity is not known."""
FRESH_S = 0.1
"""How long a measured force is used, s."""
BELIEVED = 0.3
"""The share of gravity by which a measured force may differ from the thrust. Beyond it, the thrust is used."""
DOUBT = 0.05
"""Possible error of the first vertical speed, m/s."""
LESS = 0.5
"""A battery that sags gives less thrust than the throttle says, never more. So the vertical speed may be lower than
that of the thrust by this, too: m/s^2 at first, and m/s at most. It is less than the sink speed, so the vehicle always
sinks."""
SLOWER = 0.3
"""How much faster than estimated the height may rise, m/s."""
OVERDUE, WEIGHT, LIGHTER, LIGHTEST = 0.3, 0.97, 0.04, 0.6
"""If the height is this far under the ground, m, the thrust is at most the second value of the weight, less the third
for each further metre, but at least the fourth."""
FELT = (0.015, 0.075)
"""The time between sending a throttle and the force that it causes, s: from and to."""
KEPT_S = 1.0
"""How long the thrusts are remembered, s."""
SLOWEST = 0.5
"""The slowest descent, m/s. It gives the time that a height needs that was won while the link was gone."""
BEYOND_S = 3.0
"""How much longer than twice its expected time a descent waits for an accelerometer that is not sure, s."""


@dataclass(frozen=True)
class Sense:
    """What a descent by the accelerometer starts from.

    Raises:
        ValueError: a field has a value that cannot be used for flight. The message names the field.
    """

    unit: float
    """Specific force of a count of the accelerometer, m/s^2. 0: the accelerometer must not be used."""
    forces: tuple[float, ...]
    """Specific forces, m/s^2, increasing ..."""
    pulses: tuple[int, ...]
    """... and the throttle pulse that gives each of them, us, increasing."""
    doubt: float
    """Possible error of these forces, as a share."""
    share: float
    """The share of these forces that the rotors really give."""
    velocity: tuple[float, float, float]
    """Forward, left and up along the heading, m/s."""
    upright: float
    """Cosine of the tilt."""
    height: float
    """The largest plausible height over the ground, m."""

    def __post_init__(self) -> None:
        good = {
            "forces": len(self.forces) >= 2 and all(a < b for a, b in pairwise(self.forces)),
            "pulses": len(self.pulses) == len(self.forces) and all(a < b for a, b in pairwise(self.pulses)),
            "velocity": len(self.velocity) == 3,
            "unit": self.unit >= 0,
            "share": 0 < self.share < math.inf,
        }
        numbers = (self.unit, self.doubt, self.upright, self.height, *self.velocity, *self.forces)
        good["unit"] = good["unit"] and all(map(math.isfinite, numbers))
        for name, fine in good.items():
            if not fine:
                raise ValueError(f"sense: {name} is {getattr(self, name)}; accepted: finite and as documented")


@dataclass(frozen=True)
class Descent:
    """A descent so far. Begin it with `Descent.of`."""

    velocity: tuple[float, float, float]
    """Forward, left and up along the heading, from the accelerometer, m/s."""
    lifted: float
    """Vertical speed from the thrust, m/s."""
    doubt: float
    """Possible error of `lifted`, m/s."""
    height: float
    """The largest plausible height over the ground, m."""
    share: float
    """The share of the thrust that the rotors really give."""
    expected: float
    """After so long with a link, the descent has surely ended, s."""
    now: float
    """s."""
    elapsed: float = 0.0
    """Time with a link, s."""
    trim: float = 0.0
    """m/s^2."""
    thrusts: tuple[tuple[float, float], ...] = ()
    """When the controller had which thrust: (s, m/s^2), oldest first."""
    touch: Touch = Touch()
    """Detection of the ground."""
    force: tuple[float, float, float] | None = None
    """The newest force, body FLU, m/s^2, ..."""
    felt: float = -math.inf
    """... and when it came, s."""
    attitude: Attitude = Attitude(0.0, 0.0, 0.0)
    """The last one that was known."""
    over: bool = False
    """It stands, or must be standing: the throttle is closed for good."""

    @staticmethod
    def of(sense: Sense, expected: float, held: float, now: float, age: float) -> "Descent":
        """Begin at `now`, s, `age` s after `sense`, with a controller that has held the thrust `held`, m/s^2, since.
        `expected`: see there.
        """
        forward, left, climb = sense.velocity if age <= STEP_S else (0.0, 0.0, sense.velocity[2])
        up = climb + (sense.share * held * sense.upright - GRAVITY) * age
        doubt, height = DOUBT + sense.doubt * held * age, sense.height + max(climb, up) * age
        thrusts = ((now - KEPT_S, held),)
        return Descent((forward, left, up), up, doubt, height, sense.share, expected, now, thrusts=thrusts)

    @property
    def climb(self) -> float:
        """Vertical speed, m/s: the accelerometer's, as far as the thrust allows it."""
        lowest = self.lifted - self.doubt - LESS * min(self.elapsed, 1.0)
        return max(lowest, min(self.lifted + self.doubt / 2, self.velocity[2]))

    @property
    def sink(self) -> float:
        """The wanted vertical speed, m/s."""
        return -min(SINK + FASTER * self.elapsed, FASTEST)

    def acting(self, moment: float) -> float:
        """The thrust that caused the force of a moment, s, in m/s^2."""
        start, end = moment - FELT[1], moment - FELT[0]
        known = [thrust for at, thrust in self.thrusts if start < at <= end]
        before = [thrust for at, thrust in self.thrusts if at <= start]
        every = known or before[-1:] or [self.thrusts[0][1]]
        return sum(every) / len(every)


def feel(before: Descent, sense: Sense, imu: RawImu, now: float) -> Descent:
    """Process a measurement that came at `now`, s."""
    if not sense.unit:
        return before
    x, y, z = (sense.unit * count for count in imu.acceleration)
    thrusts = tuple(before.acting(now - lag) for lag in LAGS)
    felt = touch.seen(before.touch, tuple(map(float, imu.acceleration)), thrusts[0], now)
    if felt.frozen:
        return replace(before, touch=felt, force=None)
    felt = touch.feel(felt, z, thrusts, math.hypot(*imu.body_rate), now, min(now - before.felt, FRESH_S))
    return replace(before, touch=felt, force=(x, y, z), felt=now)


def move(before: Descent, sense: Sense, attitude: Attitude | None, now: float, *, alive: bool) -> Descent:
    """Propagate the velocity to `now`, s, and decide whether the descent is over. `alive`: there is a link."""
    whole = now - before.now
    dt = min(whole, STEP_S)
    attitude = attitude or before.attitude
    thrust = before.acting(now)
    share = before.share
    force = before.force if before.force is not None and now - before.felt < FRESH_S else None
    if force is None or abs(force[2] - share * thrust) > BELIEVED * GRAVITY + sense.doubt * thrust:
        force = (0.0, 0.0, share * thrust)
    ahead, aside, above = level(attitude, force)
    forward, left, up = before.velocity
    lift = share * thrust * math.cos(attitude.roll) * math.cos(attitude.pitch)
    after = replace(
        before, velocity=(forward + ahead * dt, left + aside * dt, up + (above - GRAVITY) * dt),
        lifted=before.lifted + (lift - GRAVITY) * dt, doubt=before.doubt + sense.doubt * thrust * dt,
        now=now, elapsed=before.elapsed + dt * alive, attitude=attitude,
    )  # fmt: skip
    rise = min(after.lifted + after.doubt, after.climb + SLOWER)
    won = 0.0 if alive else max(rise, 0.0) * dt
    after = replace(after, height=before.height + rise * dt, expected=before.expected + won / SLOWEST)
    if not alive or whole > STEP_S:
        after = replace(after, velocity=(0.0, 0.0, after.velocity[2]))
    stands, late = after.touch.stands(now), after.elapsed > after.expected
    overdue = stands is None and after.elapsed > 2 * after.expected + BEYOND_S
    over = alive and (stands or (late and not after.touch.able(now)) or overdue)
    return replace(after, over=before.over or bool(over))


def command(before: Descent, attitude: Attitude | None, dt: float) -> tuple[Descent, float, tuple[float, float]]:
    """The descent after another `dt` s, the thrust to send, m/s^2, and the roll and pitch to turn to, rad."""
    now, felt = before.now, before.touch.weigh(before.now, low=-before.height > touch.UNDER)
    error = before.sink - before.climb
    trim = before.trim + TRIM_GAIN * max(-TRIM_ERROR, min(TRIM_ERROR, error)) * dt
    trim = max(-LARGEST_TRIM, min(LARGEST_TRIM, trim))
    thrust = GRAVITY + trim + max(-LARGEST, min(LARGEST, GAIN * error))
    roll = pitch = 0.0
    if attitude is not None:
        forward, left, _ = before.velocity
        speed = math.hypot(forward, left)
        share = min(BRAKE_GAIN, BRAKE / speed) if speed > 0 and before.elapsed < BRAKE_S else 0.0
        roll, pitch = math.atan(share * left / GRAVITY), -math.atan(share * forward / GRAVITY)
        thrust /= max(math.cos(attitude.roll) * math.cos(attitude.pitch), 0.5)
    if -before.height > OVERDUE:
        thrust = min(thrust, GRAVITY * max(WEIGHT + LIGHTER * before.height, LIGHTEST))
    thrust = min(thrust, touch.LOW * GRAVITY) if felt.weighs(now) else thrust * touch.wave(now)
    return replace(before, touch=felt, trim=trim), thrust / before.share, (roll, pitch)


def sent(before: Descent, thrust: float, now: float) -> Descent:
    """The descent after the controller got, or held, a thrust, m/s^2, at `now`, s."""
    kept = tuple((at, was) for at, was in before.thrusts if at > now - KEPT_S)
    return replace(before, thrusts=(*(kept or before.thrusts[-1:]), (now, thrust)))


def between(xs: Sequence[float], ys: Sequence[float], x: float) -> float:
    """The value at `x` on the line through the points, whose `xs` increase. Beyond them, that of the first or last."""
    i = min(max(bisect_right(xs, x) - 1, 0), len(xs) - 2)
    share = min(max((x - xs[i]) / (xs[i + 1] - xs[i]), 0.0), 1.0)
    return ys[i] + share * (ys[i + 1] - ys[i])
