"""The watchdog of a flight over Betaflight: how it lands the vehicle when the bridge dies or hangs.

Under MSP override, Betaflight continues with the last sticks that it received. Some versions do so for ever, others for
0.3 s. After that the pilot's own sticks are used, but the pilot may not be holding them. So the link belongs to a small
process (`watched_link.py`). When the bridge has ended, or has been silent for `TIMEOUT_S` in flight, this process takes
over for good. It levels the vehicle with the controller's own attitude and descends gently with the throttle that the
bridge had learned. Then it keeps the throttle closed until the pilot disarms.
"""

import json
import time
from bisect import bisect_right
from contextlib import suppress
from dataclasses import dataclass
from itertools import chain, pairwise
from math import inf
from typing import Any

from e2efly.flight.attitude import Attitude
from e2efly.flight.betaflight.codec import REPLY, Decoder, MspFrame, encode
from e2efly.flight.betaflight.descent import Descent, Sense, between, command, feel, move, sent
from e2efly.flight.betaflight.messages import (
    CHANNEL_RANGE,
    MAX_CHANNELS,
    SET_RAW_RC,
    AttitudeReply,
    RawImu,
    StatusEx,
    set_raw_rc,
)
from e2efly.flight.link import MOST, Link, open_link
from e2efly.flight.watched_link import watch_over
from e2efly.vehicles.gravity import GRAVITY

PROGRAM = "e2efly.flight.betaflight.watchdog"
"""This module, which runs as a process."""
TIMEOUT_S = 0.1
"""Silence of the bridge in flight after which this process takes over, s."""
PERIOD_S = 0.01
"""Time between two frames of a take-over, s."""
STALE_S = 0.2
"""A controller's attitude that is older than this is not used for levelling, s."""
DEAF_S = 10.0
"""If the controller has not reported for this time whether it is armed, it is given up after the descent, s. After such
a silence the descent goes on, too."""
ASKED = (StatusEx, *(AttitudeReply, RawImu) * 5)
"""What the frames of a take-over ask for, in turn, ..."""
ASKED_AFTER = (StatusEx, AttitudeReply)
"""... and after it."""
ARM = 1
"""Bit of the mode ARM in `StatusEx.boxes`: it is always the first."""
LEVEL_GAIN = 4.0
"""Body rate divided by tilt, 1/s."""
LEVEL_RATE = 3.0
"""Largest body rate of levelling, rad/s."""


@dataclass(frozen=True)
class DescentPlan:
    """What to do without the bridge. It is given in pulses, so nothing about controller or vehicle need be known.

    Raises:
        ValueError: a field has a value that cannot be used for flight. The message names the field.
    """

    flying: bool
    """The vehicle is in flight, so silence of the bridge leads to a take-over."""
    rates: tuple[float, ...]
    """Body rates for which `pulses` are given, rad/s, increasing."""
    pulses: tuple[tuple[int, ...], tuple[int, ...], tuple[int, ...]]
    """Pulses of the roll, pitch and yaw sticks at each of `rates`, us."""
    places: tuple[int, int, int, int]
    """The positions of roll, pitch, yaw and throttle in a frame of channels."""
    throttle: tuple[tuple[float, int], ...]
    """The descent: (time since the take-over, s, throttle pulse, us), with increasing times. The last pulse is held."""
    channels: tuple[int, ...]
    """The frame whose other channels are kept, us."""
    sense: Sense | None = None
    """What a descent by the accelerometer starts from: of `throttle`, only the last time is then used. None: the
    descent is that of `throttle`."""

    def __post_init__(self) -> None:
        n, count = len(self.rates), len(self.channels)
        times = [at for at, _ in self.throttle]
        given = [*self.channels, *(pulse for _, pulse in self.throttle), *chain(*self.pulses)]
        low, high = CHANNEL_RANGE
        good = {
            "rates": n >= 2 and all(a < b for a, b in pairwise(self.rates)),
            "pulses": len(self.pulses) == 3 and all(len(row) == n for row in self.pulses),
            "places": len(set(self.places)) == 4 and all(0 <= place < count for place in self.places),
            "throttle": bool(times) and all(a <= b for a, b in pairwise(times)) and 0 <= times[0] <= times[-1] < inf,
            "channels": 4 <= count <= MAX_CHANNELS and all(type(p) is int and low <= p <= high for p in given),
        }
        for name, fine in good.items():
            if not fine:
                raise ValueError(f"plan: {name} is {getattr(self, name)}; accepted: as documented, {low} to {high} us")


def descent(plan: DescentPlan, elapsed: float, attitude: Attitude | None) -> list[int]:
    """The channels of a take-over without an accelerometer, us. `elapsed` is the time since the take-over, s. If the
    controller's attitude is unknown, the body rates are zero.
    """
    times = [at for at, _ in plan.throttle]
    return _channels(plan, plan.throttle[max(bisect_right(times, elapsed) - 1, 0)][1], attitude)


def _channels(
    plan: DescentPlan, throttle: int, attitude: Attitude | None, lean: tuple[float, float] = (0.0, 0.0)
) -> list[int]:
    """The channels that turn towards a roll and pitch, rad, with a throttle pulse, us."""
    wanted = [0.0, 0.0, 0.0]
    if attitude is not None:
        for i, angle in enumerate((lean[0] - attitude.roll, lean[1] - attitude.pitch)):
            wanted[i] = max(-LEVEL_RATE, min(LEVEL_RATE, LEVEL_GAIN * angle))
    channels = list(plan.channels)
    for place, rate, pulses in zip(plan.places, wanted, plan.pulses, strict=False):
        channels[place] = round(between(plan.rates, pulses, rate))
    channels[plan.places[3]] = throttle
    return channels


def land(link: Link, plan: DescentPlan, held: bytes = b"", age: float = 0.0) -> None:
    """Level, descend, close the throttle, and keep it closed until the pilot has disarmed or nobody answers.

    The closed throttle must be sent all the time. Some controllers return the control to the receiver when they hear no
    override any more, and the throttle stick, which rests in its middle, would then control the motors.

    While the link is gone, the controller holds what it got last, and the descent does not go on. `plan` is the last
    plan of the bridge, and `age` how old it is, s. `held` is the last stick frame of the bridge, which the controller
    has held since.
    """
    decoder, attitude, levelled, disarmed, rounds = Decoder(), None, time.monotonic(), 0, 0
    sense, down = plan.sense, plan.throttle[-1][0]
    before = heard = told = time.monotonic()
    fall = None if sense is None else Descent.of(sense, down, _thrust(plan, sense, held), before, age)
    elapsed, thrust, closed_at = 0.0, 0.0, inf
    while True:
        link.poll(now := time.monotonic())
        for frame in decoder.feed(link.receive()[-MOST:]):
            if frame.direction != REPLY:
                continue
            heard = now
            with suppress(ValueError):  # a reply that cannot be parsed is ignored
                if frame.code == AttitudeReply.CODE:
                    attitude, levelled = AttitudeReply.parse(frame.payload), now
                elif frame.code == StatusEx.CODE:
                    disarmed, told = 0 if StatusEx.parse(frame.payload).boxes & ARM else disarmed + 1, now
                elif frame.code == RawImu.CODE and fall is not None and sense is not None:
                    fall = feel(fall, sense, RawImu.parse(frame.payload), now)
        attitude = attitude if now - levelled < STALE_S else None
        acts = link.alive and now - heard < STALE_S
        goes_on, dt = acts or now - heard > DEAF_S, now - before
        elapsed, before = elapsed + dt * goes_on, now
        if fall is None or sense is None:
            channels = descent(plan, elapsed, attitude)
            over = elapsed >= down
        else:
            if attitude is not None or now - levelled > STALE_S:
                fall = move(fall, sense, attitude, now, alive=goes_on)
            fall, wanted, lean = command(fall, attitude, dt)
            pulse, over = round(between(sense.forces, sense.pulses, wanted)), fall.over
            channels = _channels(plan, plan.throttle[-1][1] if over else pulse, attitude, lean)
            thrust = wanted if acts else fall.thrusts[-1][1]
            fall = sent(fall, thrust, now)
        closed_at = min(closed_at, now) if over else inf
        if over and (disarmed >= 2 or now - max(told, closed_at) > DEAF_S):
            break
        asked = ASKED_AFTER if over else ASKED
        link.send(encode(set_raw_rc(channels)) + encode(MspFrame(asked[rounds % len(asked)].CODE)))
        rounds += 1
        time.sleep(PERIOD_S)
    link.close()


def _thrust(plan: DescentPlan, sense: Sense, frame: bytes) -> float:
    """The thrust of a stick frame, m/s^2. Without one, that of hover."""
    for told in Decoder().feed(frame):
        at = 2 * plan.places[3]
        if told.code == SET_RAW_RC and len(told.payload) >= at + 2:
            return between(sense.pulses, sense.forces, int.from_bytes(told.payload[at : at + 2], "little"))
    return GRAVITY


def _plan(content: bytes) -> DescentPlan | None:
    """The plan in a packet. None: it is not a valid plan, because an unreadable plan must not end this process."""
    try:
        x = json.loads(content)
        roll, pitch, yaw = (tuple(pulses) for pulses in x["pulses"])
        a, b, c, d = x["places"]
        steps = tuple((at, pulse) for at, pulse in x["throttle"])
        known: dict[str, Any] = {k: tuple(v) if isinstance(v, list) else v for k, v in (x["sense"] or {}).items()}
        sense = Sense(**known) if known else None
        channels = tuple(x["channels"])
        return DescentPlan(x["flying"], tuple(x["rates"]), (roll, pitch, yaw), (a, b, c, d), steps, channels, sense)
    except (ValueError, TypeError, KeyError, AttributeError):
        return None


@dataclass
class StickLander:
    """Lands over MSP override, by the newest plan of the bridge."""

    plan: DescentPlan | None = None
    planned: float = 0.0
    """When `plan` came, s."""
    held: bytes = b""
    """The last stick frame of the bridge."""

    @property
    def flying(self) -> bool:
        """Whether silence of the bridge leads to a take-over."""
        return self.plan is not None and self.plan.flying

    def passed(self, data: bytes) -> None:
        """Bytes of the bridge have been passed on."""
        self.held = data if data[4:5] == bytes([SET_RAW_RC]) else self.held

    def follow(self, content: bytes) -> None:
        """Take a new plan. One that cannot be read leaves the last one."""
        self.plan, self.planned = _plan(content) or self.plan, time.monotonic()

    def land(self, link: Link) -> None:
        """Land, until the pilot has disarmed."""
        if self.plan is not None:
            land(link, self.plan, self.held, time.monotonic() - self.planned)


if __name__ == "__main__":
    watch_over(open_link, StickLander())
