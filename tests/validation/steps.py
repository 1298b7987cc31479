"""Steps of body rate and thrust, flown through the real firmware, and the log of its sensors."""

import dataclasses
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from e2efly.control import COMMAND_MODES, Quat, Vec3
from e2efly.flight.betaflight.client import SCHEDULE, Client
from e2efly.flight.betaflight.controller import identify
from e2efly.flight.betaflight.messages import set_raw_rc
from e2efly.flight.betaflight.sticks import sticks_of
from e2efly.flight.link import open_link
from e2efly.flight.pilot.hover import flight_gains
from e2efly.flight.pilot.throttle_map import ThrottleMap
from e2efly.logs.recording import Record, Stream
from e2efly.validation.plant import PlantMotion
from e2efly.validation.rig import Rig
from e2efly.validation.sitl import FirmwareState
from e2efly.vehicles.gravity import GRAVITY

LINK_RATE_HZ = 100.0
"""Rate of the commands, Hz."""
SIZES = (4.0, 3.0, 3.0, 2.0)
"""Sizes of the steps of thrust over mass, m/s^2, and of the body rates, rad/s."""
HOLD_S = 0.3
"""Duration of a step, s. The opposite step of the same duration follows."""
REST_S = 0.2
"""Time with zero rates before and after each pair of steps, s."""
CALM_S = 1.0
"""Time between pairs of steps in which the pilot corrects, s."""
HEIGHT = 10.0
"""Height of the flight, m."""
CLIMB_S = 6.0
"""Time for take-off and climb, s."""


QUICKER = tuple(
    f"set {term}_{axis}={value}"
    for axis, pid in (("roll", (40, 40, 50)), ("pitch", (42, 40, 55)), ("yaw", (120, 20, 100)))
    for term, value in zip("pid", pid, strict=True)
)
"""A tune of VIS-R that is quicker than its file says: 63 % of a step of roll rate in 45 ms, with 20 % overshoot."""


@dataclass(frozen=True)
class SetpointStep:
    """A change of one of the four commands, from rest."""

    time: float
    """Time at which it was sent, s of the record's clock."""
    channel: int
    """0: thrust over mass; 1 to 3: body rate about x, y, z."""
    size: float
    """Size of the change, m/s^2 or rad/s."""


class _Hand:
    """Sends commands to the firmware, and records the input of its sensors and the commands."""

    def __init__(self, rig: Rig) -> None:
        vehicle = rig.world.vehicle
        self.rig, self.keeps = rig, False
        self.client = Client(open_link(rig.sitl.msp), dict(SCHEDULE))
        self.sticks = sticks_of(identify(self.client, 3.0, clock=rig))
        self.map = ThrottleMap.of(vehicle)
        slow = flight_gains(vehicle, 0.05)
        self.steer = dataclasses.replace(slow, velocity_gain=np.minimum(slow.velocity_gain, 1.5))
        self.sensed: list[np.ndarray] = []
        self.sent: list[np.ndarray] = []
        rig.felt = self._feel

    def _feel(self, state: FirmwareState) -> FirmwareState:
        if self.keeps:
            motors = self.rig.sitl.motors()
            parts = (state.body_rate, state.specific_force, state.quaternion, state.velocity, state.position, motors)
            self.sensed.append(np.concatenate([[self.rig.now()], *parts]))
        return state

    def fly(self, seconds: float, command: np.ndarray | None = None) -> None:
        """Hold a command for `seconds`. Without a command, hover at the target."""
        for _ in range(round(seconds * LINK_RATE_HZ)):
            given = self._hover() if command is None else command
            throttle = min(self.map.throttle(float(given[0])), self.sticks.throttle.largest)
            self._send(self.sticks.channels_of(throttle, given[1:].tolist(), ()).channels)
            if self.keeps:
                self.sent.append(np.concatenate([[self.rig.now()], given]))

    def arm(self) -> None:
        """Hand over control, and arm with closed throttle."""
        middle = self.sticks.centre
        closed = self.sticks.arrange((middle, middle, middle, 1000), ())
        for change in ({"override": True}, {"armed": True}):
            self.rig.set(**change)
            for _ in range(round(0.5 * LINK_RATE_HZ)):
                self._send(closed)

    def _send(self, channels: tuple[int, ...]) -> None:
        self.rig.sleep(1 / LINK_RATE_HZ)
        self.client.poll(self.rig.now())
        self.client.set_raw_rc(set_raw_rc(channels), self.rig.now())

    def _hover(self) -> np.ndarray:
        s, controller = self.rig.state, COMMAND_MODES["position"].controller
        assert controller is not None
        motion = PlantMotion(Vec3(*s.position), Vec3(*s.velocity), Quat(*s.quaternion))
        wanted = controller(self.steer, motion, (0.0, 0.0, HEIGHT, 0.0))
        return np.array([wanted.thrust, wanted.rate.x, wanted.rate.y, wanted.rate.z], float)


def fly_steps(rig: Rig, shares: tuple[float, ...] = (1.0, -1.0, 0.6, -0.6)) -> tuple[Record, list[SetpointStep]]:
    """Take off, and fly steps of roll, pitch and yaw rate and of thrust in both directions, with pauses between them.

    Each share of `SIZES` gives one step of each command.

    Returns:
        The values of gyroscope, accelerometer, poses and motor outputs at every step of the rig, with the commands as
        they were sent; and the steps.
    """
    hand, steps = _Hand(rig), []
    try:
        hand.arm()
        hand.fly(CLIMB_S)
        hand.keeps = True
        rest = np.array([GRAVITY, 0.0, 0.0, 0.0])
        for share in shares:
            for channel, size in enumerate(SIZES):
                hand.fly(CALM_S)
                hand.fly(REST_S, rest)
                change, begun = share * size * np.eye(4)[channel], len(hand.sent)
                hand.fly(HOLD_S, rest + change)
                steps.append(SetpointStep(float(hand.sent[begun][0]), channel, share * size))
                hand.fly(HOLD_S, rest - change)
                hand.fly(REST_S, rest)
        hand.fly(CALM_S)
    finally:
        rig.felt = None
        hand.client.link.close()
    time, *sensed = np.split(np.array(hand.sensed), [1, 4, 7, 11, 14, 17], axis=1)
    names = ("body_rate", "specific_force", "quaternion", "velocity", "position", "motor")
    streams = {name: Stream(time[:, 0], values) for name, values in zip(names, sensed, strict=True)}
    sent = np.array(hand.sent)
    return Record(Path("steps.csv"), {**streams, "command": Stream(sent[:, 0], sent[:, 1:])}), steps
