"""The plan that a flight gives to the watchdog: how to descend if the bridge falls silent from now on."""

import math
from dataclasses import dataclass

import numpy as np

from e2efly.control import Ctbr
from e2efly.flight.betaflight.autopilot import Betaflight
from e2efly.flight.betaflight.descent import Sense
from e2efly.flight.betaflight.instruments import CLOSED
from e2efly.flight.betaflight.sticks import Sticks
from e2efly.flight.betaflight.watchdog import DescentPlan
from e2efly.flight.bridge import Bridge
from e2efly.flight.pilot.flight_state import GROUNDED, Mode
from e2efly.flight.pilot.hover import blind, blind_time, sink_time
from e2efly.flight.watched_link import WatchedLink
from e2efly.vehicles.gravity import GRAVITY

PLAN_RATES = tuple(0.5 * i for i in range(-6, 7))
"""Body rates of the watchdog's tables, rad/s."""
PLAN_FORCES = tuple(float(i) for i in range(26))
"""Specific forces of the watchdog's table, m/s^2."""


@dataclass(frozen=True)
class DescentWatchdog:
    """The watchdog of a flight over Betaflight's sticks."""

    link: WatchedLink
    autopilot: Betaflight

    @property
    def taken_over(self) -> str:
        """Why the watchdog has taken over. Empty: it has not."""
        return self.link.taken_over

    def follow(self, bridge: Bridge) -> None:
        """Give it a new plan."""
        self.link.plan(plan_of(bridge, self.autopilot.sticks))


def plan_of(bridge: Bridge, sticks: Sticks) -> DescentPlan:
    """What the watchdog has to do from now on if the bridge falls silent."""
    voltage = bridge.inputs.voltage

    def throttle(command: Ctbr) -> int:
        share = min(bridge.map.throttle(float(command.thrust), voltage), sticks.throttle.largest)
        return sticks.throttle.channel_for(share)

    roll, pitch, yaw = (tuple(sticks.pulse(axis, rate) for rate in PLAN_RATES) for axis in range(3))
    climb = float(bridge.odometry.velocity[2]) if bridge.odometry is not None else 0.0
    begin = sink_time(climb)
    end = max(blind_time(bridge.height, climb), 2 * begin)
    steps = ((0.0, CLOSED),) if bridge.flight.mode in GROUNDED else (
        (0.0, throttle(blind(None, 0.0, climb))), (begin, throttle(blind(None, 2 * begin + 1.0, climb))), (end, CLOSED),
    )  # fmt: skip
    a, b, c, d = sticks.channel[:4]
    mid = sticks.centre
    idle = sticks.arrange((mid, mid, mid, CLOSED), ())
    flying = bridge.flying or bridge.flight.mode is Mode.PILOT or bridge.inputs.armed
    sense = None if len(steps) == 1 else _sense(bridge, sticks)
    return DescentPlan(flying, PLAN_RATES, (roll, pitch, yaw), (a, b, c, d), steps, idle, sense)


def _sense(bridge: Bridge, sticks: Sticks) -> Sense | None:
    """What the watchdog's descent by the accelerometer starts from. None: nothing is known of the motion."""
    told = bridge.estimate.inertial
    moves = told.reckoned
    if moves is None:
        return None
    table: dict[int, float] = {}  # by pulse, because a throttle has a largest
    for force in PLAN_FORCES:
        share = min(bridge.map.throttle(force, bridge.inputs.voltage), sticks.throttle.largest)
        table.setdefault(sticks.throttle.channel_for(share), force)
    gravity = 0.0 if told.rest is None or told.frozen else float(np.linalg.norm(told.rest))
    forward, left, _ = moves.velocity
    attitude = moves.attitude
    return Sense(
        unit=told.scale.value * GRAVITY / gravity if gravity > 0 else 0.0,
        forces=tuple(table.values()),
        pulses=tuple(table),
        doubt=bridge.map.doubt,
        share=told.share,
        velocity=(forward, left, moves.climb),
        upright=1.0 if attitude is None else math.cos(attitude.roll) * math.cos(attitude.pitch),
        height=moves.height - bridge.flight.home,
    )
