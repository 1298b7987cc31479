"""The bridge over a link that falls silent: a vehicle that moves up and down, and whose controller holds a command."""

from dataclasses import dataclass, field, replace

import numpy as np
import pytest

from e2efly.flight.attitude import Attitude
from e2efly.flight.betaflight.autopilot import Betaflight
from e2efly.flight.betaflight.client import SCHEDULE, Client, Reply
from e2efly.flight.betaflight.controller import ControllerInfo, identify
from e2efly.flight.betaflight.instruments import Reading
from e2efly.flight.betaflight.messages import SET_RAW_RC, MotorTelemetry, RawImu
from e2efly.flight.bridge import Bridge
from e2efly.flight.pilot.flight_state import Flight, Mission, Mode, Pilot, Target
from e2efly.flight.pilot.throttle_map import ThrottleHistory
from e2efly.flight.settings import FlightSettings
from e2efly.policy.odometry import Sample
from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.loading import load_vehicle
from tests.flight.test_msp_client import Wire, controller, recorded
from tests.flight.test_pose_tracking import sample

DT = 0.01
"""Of the bridge, s. A measurement comes at every second step."""
COUNTS = 2048.0 / GRAVITY


@dataclass
class World:
    """The vehicle, its poses and its controller, of which it plays the parts that the bridge asks."""

    info: ControllerInfo
    now: float = 100.0
    height: float = 1.0
    climb: float = 0.0
    armed: bool = False
    answers: bool = True
    hears: bool = True
    problem: str | None = None
    refused: int = 0
    fresh: dict[int, Reply] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.wire, self.acts, self.throttle = Wire(), ThrottleHistory(), 0.0
        self.client = Client(self.wire, {code: rate for code, rate in SCHEDULE.items() if code != MotorTelemetry.CODE})
        self.autopilot = Betaflight(self.client, self.info, FlightSettings())
        self.bridge = Bridge(self.autopilot, self, load_vehicle("vis_r"), FlightSettings())
        self.autopilot.instruments = self  # type: ignore[assignment]
        self.plant = self.bridge.map

    def close(self) -> None:
        """Nothing is open."""

    def read(self, now: float, *of: object, **_: object) -> object:
        """The poses; with the arguments of the instruments, what the controller tells."""
        if not of:
            return [self.pose(now)]
        problem = None if now - self.client.heard < 0.25 else "silent"
        level, pilot = Attitude(0.0, 0.0, 0.0), Pilot(Mission.HOVER)
        return Reading(problem, self.armed, True, pilot, False, 3.9, (), None, level, self.fresh)

    def pose(self, now: float) -> Sample:
        """Level, at its height."""
        return sample(now, received=now, position=np.array([0.0, 0.0, self.height + 1e-6 * np.sin(1e5 * now)]))

    def fly(self, seconds: float) -> None:
        for k in range(round(seconds / DT)):
            self.now += DT
            felt = self.acts.felt(self.now)
            force = GRAVITY if felt is None or not self.armed else self.plant.force(felt, 3.9)
            self.climb += (force - GRAVITY) * DT
            self.height += self.climb * DT
            self.fresh = {}
            if self.answers and k % 2 == 0:
                counts = COUNTS * np.array([0.01 * np.sin(self.now), 0.0, force])
                self.fresh = {RawImu.CODE: Reply(RawImu(tuple(counts.tolist()), (0.0, 0.0, 0.0)), self.now, 0.002)}
                self.client.latest |= self.fresh
            sent = self.bridge.tick(self.now)
            if self.hears:
                self.throttle = sent.throttle
            else:
                self.wire.sent = [frame for frame in self.wire.sent if frame.code != SET_RAW_RC]
            if self.answers:
                self.wire.answer()
            self.wire.sent.clear()
            self.acts.add(self.now, self.throttle)


def hovering() -> World:
    with controller(recorded) as client:
        world = World(identify(client, 10.0))
    world.fly(0.5)
    world.armed = True
    begun = Flight(Mode.HOVER, now=world.now, since=world.now)
    world.bridge.flight = replace(begun, target=Target((0.0, 0.0, 1.0), 0.0))
    world.fly(4.0)
    return world


def test_a_silence_in_which_the_controller_held_a_command_teaches_nothing() -> None:
    """It held a little too much thrust, and climbed. Its answers come back before commands arrive again."""
    world = hovering()
    assert world.bridge.flight.mode is Mode.HOVER and abs(world.height - 1.0) < 0.2
    before, told = world.bridge.map, world.bridge.estimate.inertial
    assert before.updates > 100
    world.throttle *= 1.03
    world.hears = world.answers = False
    world.fly(0.7)
    world.answers = True
    world.fly(0.3)
    assert world.climb > 0.2
    assert world.bridge.map.updates == before.updates and world.bridge.map.learned == before.learned
    assert world.bridge.estimate.inertial.share == told.share
    world.hears = True
    world.fly(0.2)
    assert world.bridge.map.updates == before.updates  # what was sent before then did not act
    world.fly(4.0)
    after = world.bridge.estimate.inertial
    assert world.client.delivered(world.now - 0.3, world.now - 0.02)
    assert after.share == pytest.approx(told.share, abs=0.01)
    assert after.scale.value == pytest.approx(told.scale.value, abs=0.02)
    assert world.bridge.map.learned[0] == pytest.approx(before.learned[0], abs=0.01)


@pytest.mark.parametrize("received", [True, False])
def test_a_command_to_a_port_that_is_gone_did_not_act(received: bool) -> None:
    """The motion is propagated with what the controller has held since."""
    world = hovering()
    held = world.bridge.sent.throttle
    world.throttle = held
    world.hears = world.answers = False
    world.wire.alive = received
    world.fly(0.6)
    sent = world.bridge._history.between(world.now - 0.2, world.now)
    assert sent is not None
    assert (abs(sent - held) < 0.01) is not received
