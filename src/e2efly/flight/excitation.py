"""An excitation flight or a flight of steps in place of a policy: it observes and commands as a policy does, and the
bridge flies it as one.

It consists of a contract, an `act` and a course. The modes, fence, guard, watchdog and the pilot's switch are the same
as for every policy.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from e2efly import __version__
from e2efly.config.numbers import SPEED, check_fields, number
from e2efly.control import COMMAND_MODES, Quat, Vec3, command_limits
from e2efly.control.manoeuvres import (
    DURATION,
    KICK,
    TILT,
    ManoeuvreProgress,
    ManoeuvreRoom,
    Manoeuvres,
    Schedule,
    excite,
    length_for,
    softened,
)
from e2efly.control.step_schedule import Steps
from e2efly.flight.pilot.hover import FlightMotion, flight_gains
from e2efly.flight.settings import FlightSettings
from e2efly.policy.contract import CONTRACT_VERSION, Action, Contract
from e2efly.policy.goal import Course, Goal, Observed, Outcome
from e2efly.policy.observation import ATTITUDE, VELOCITY, Field
from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.vehicle import Vehicle

CONTROL_RATE = 100.0
"""The rate at which it acts, Hz."""
MARGIN, FLOOR = 0.3, 0.6
"""The distance that it keeps to the inside of the fence, m, and its lowest height over the ground, m."""
SLOWEST, LEAST_HEIGHT = 1.2, 1.0
"""The fence must have room for lines of this speed, m/s, and this height inside the margins, m."""
BRAKING, REACTION = 3.5, 0.45
"""The deceleration that its turns assume, m/s^2, and the time before it acts, s, unless the fence's values are
worse."""
PULSED = 0.45
"""The tilt that doublets and chirps may add to the tilt for steering, rad."""
LEAST_TILT = 0.3
"""The smallest tilt that must remain for steering below the fence's tilt, rad."""
ASTRAY = 0.5
"""How far from its place a step may begin or, by the speed that is left, end, m."""
STEEPEST = 1.0
"""The largest tilt of a step, rad. Further, the thrust of hover no longer carries half of the weight."""
QUICK = 0.8
"""The share of the fence's speed that is flown."""
_ELAPSED = Field("elapsed", 1, "none", "s", 1.0, "time since the beginning")
_PLACE = Field("place", 3, "world", "m", 1.0, "position of the centre of mass")


@dataclass(frozen=True)
class ExcitationOptions:
    """Options of an excitation flight."""

    seconds: float = number(DURATION, low=10.0, high=300.0)
    """Duration, s."""
    speed: float = number(5.0, above=0, high=SPEED)
    """Speed of the fastest line, m/s. The fence's room and its speed may allow less."""


@dataclass(frozen=True)
class StepsOptions:
    """Options of a flight of steps."""

    rate: float = number(2.0, low=0.5, high=6.0)
    """Size of the steps of body rate, rad/s. The vehicle tilts by this times the length."""
    thrust: float = number(3.0, low=0.5, high=8.0)
    """Size of the steps of thrust over mass, m/s^2."""
    length: float = number(0.2, low=0.1, high=0.5)
    """Duration of each step, s. The opposite step of the same duration follows."""
    count: int = number(3, low=1, high=20)
    """Number of such pairs about each axis, and of the thrust."""


SMALLER = ", or smaller --steps.rate, --steps.length or --steps.thrust"
InPlace = ExcitationOptions | StepsOptions
"""Options of what flies in place of a policy."""
NAMES: dict[str, type[InPlace]] = {"excitation": ExcitationOptions, "steps": StepsOptions}
"""What may stand in place of a policy on the command line, and in the contract."""


@dataclass(frozen=True)
class ExcitationGoal(Goal):
    """Provides the time and the position, and judges nothing. The duration of the course ends it."""

    observation: ClassVar[tuple[Observed, ...]] = (
        (_ELAPSED, lambda goal, memory, time, state: time[:, None]),
        (_PLACE, lambda goal, memory, time, state: state.position),
    )
    config: InPlace
    middle: np.ndarray
    """(3,) middle of the room, m."""

    def goal(self, memory: Any, time: Any) -> Any:
        """The middle of the room."""
        return np.broadcast_to(self.middle, (len(time), 3))

    def advance(self, memory: Any, before: Any, after: Any, time: Any, timed_out: Any) -> tuple[Any, Outcome]:
        """Never ends the flight by itself."""
        no, off = np.zeros(len(time), bool), np.linalg.norm(after.position - self.middle, axis=-1)
        return memory, Outcome(terminated=no, success=timed_out, arrived=no, crashed=no, error=off)


@dataclass(frozen=True)
class Excitation:
    """Acts as a policy does. Create it with `excitation`."""

    contract: Contract
    """What it observes and commands."""
    vehicle: Vehicle
    """The vehicle with the gains for steering."""
    room: ManoeuvreRoom
    """The room in which it stays."""
    schedule: Schedule
    """What it flies in the room."""

    def act(
        self, observation: np.ndarray, images: Sequence[np.ndarray] = (), memory: np.ndarray | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """The action for an observation, and the memory for the next call. The observation is (o,) as
        `contract.observation` defines it. `images` are not used. At the beginning of a flight, there is no memory. The
        action is float32 (4,) in [-1, 1], and the memory float64 (memory_size,).

        Raises:
            ValueError: if the observation has a number that is not finite.
        """
        del images
        if not np.isfinite(observation).all():
            raise ValueError(f"observation is {observation.tolist()}; accepted: finite numbers")
        seen = {name: np.asarray(observation[part], np.float64) for name, part in self.contract.slices.items()}
        place, attitude = seen[_PLACE.name], Quat(*seen[ATTITUDE.name])
        motion = FlightMotion(Vec3(*place), Vec3(*seen[VELOCITY.name]), attitude)
        before = (
            ManoeuvreProgress.begin(self.room, place, float(attitude.yaw())) if memory is None else _progress(memory)
        )
        time = float(seen[_ELAPSED.name][0])
        after, command = excite(self.vehicle, self.room, self.schedule, before, time, motion)
        wanted = np.array([command.thrust, command.rate.x, command.rate.y, command.rate.z], np.float64)
        return self.contract.action.asking(wanted), _memory(after)


def excitation(
    vehicle: Vehicle, settings: FlightSettings, options: InPlace, latency: float | None = None
) -> tuple[Excitation, Course]:
    """An excitation flight or a flight of steps inside a fence, and its course, for `Runtime.of`. `latency` is the
    time from the vehicle's motion to its rate loop, s. None: the value of the vehicle file.

    Raises:
        ValueError: naming the option, or the part of the fence that is too small, and what is needed.
    """
    name = next(name for name, kind in NAMES.items() if isinstance(options, kind))
    check_fields(name, options)
    late: float = vehicle.latency if latency is None else latency
    if isinstance(options, StepsOptions):
        _check_steps(vehicle, options)
    need = _need(settings, options)
    room = room_of(settings, name, need)
    if isinstance(options, StepsOptions):
        schedule: Schedule = _steps(options)
    else:
        schedule = Manoeuvres(options.seconds, min(options.speed, QUICK * settings.fence.speed))
    steer = softened(flight_gains(vehicle, late), min(TILT, settings.fence.tilt - need.tilt))
    goal = ExcitationGoal(options, (room.low + room.high) / 2)
    acts = Excitation(_contract(name, vehicle, late), steer, room, schedule)
    return acts, Course(goal, np.zeros(1), goal.middle, duration=schedule.seconds)


def _steps(options: StepsOptions) -> Steps:
    return Steps(options.rate, options.thrust, options.length, options.count)


@dataclass(frozen=True)
class Need:
    """What a flight needs of the fence."""

    lengths: np.ndarray
    """(3,) room between the margins, m."""
    speed: float
    """Its speed, m/s."""
    tilt: float
    """The tilt beyond that for steering, rad."""
    less: str = ""
    """What may be made smaller instead."""


def _need(settings: FlightSettings, options: InPlace) -> Need:
    """What a flight needs of the fence."""
    braking, reaction = _stopping(settings)
    if isinstance(options, StepsOptions):
        steps = _steps(options)
        lengths = 2 * (steps.reach(braking, reaction) + ASTRAY)
        return Need(lengths, float(max(steps.speed())), steps.tilt, SMALLER)
    level = length_for(SLOWEST, braking, reaction)
    return Need(np.array([level, level, LEAST_HEIGHT]), SLOWEST, PULSED)


def _stopping(settings: FlightSettings) -> tuple[float, float]:
    """The deceleration, m/s^2, and the time before it, s, with which a flight counts."""
    return min(BRAKING, settings.fence.braking), max(REACTION, settings.fence.reaction)


def _check_steps(vehicle: Vehicle, options: StepsOptions) -> None:
    """Refuse steps that tilt too far, or that the vehicle cannot follow."""
    tilt = _steps(options).tilt
    if tilt > STEEPEST:
        raise ValueError(f"steps.rate times steps.length is {tilt:.3g}; accepted: up to {STEEPEST:g} rad")
    fastest = float(np.min(vehicle.body_rate_max))
    if options.rate > fastest:
        raise ValueError(f"steps.rate is {options.rate:g}; accepted for {vehicle.name}: up to {fastest:.2g} rad/s")
    most = (KICK * vehicle.thrust_to_weight - 1) * GRAVITY
    if options.thrust > most:
        raise ValueError(f"steps.thrust is {options.thrust:g}; accepted for {vehicle.name}: up to {most:.2g} m/s^2")


def room_of(settings: FlightSettings, name: str, need: Need) -> ManoeuvreRoom:
    """The room in which a flight stays inside a fence.

    Raises:
        ValueError: naming the part of the fence that is too small, and what is needed.
    """
    fence = settings.fence
    low, high = np.add(fence.low, MARGIN), np.subtract(fence.high, MARGIN)
    low[2] = max(low[2], settings.ground_height + FLOOR)
    for axis, under, over, room, needed in zip("xyz", fence.low, fence.high, high - low, need.lengths, strict=True):
        if room < needed:
            inside = f"{MARGIN:g} m inside it" + (f" and {FLOOR:g} m over the ground" if axis == "z" else "")
            raise ValueError(
                f"flight.fence.low and flight.fence.high are {under:g} and {over:g} in {axis}, which leaves "
                f"{max(room, 0.0):.2g} m {inside}; accepted for {name}: {needed:.2g} m or more there{need.less}"
            )
    if fence.speed * QUICK < need.speed:
        least = need.speed / QUICK
        raise ValueError(
            f"flight.fence.speed is {fence.speed:g}; accepted for {name}: {least:.3g} m/s or more{need.less}"
        )
    if fence.tilt < LEAST_TILT + need.tilt:
        least = LEAST_TILT + need.tilt
        raise ValueError(
            f"flight.fence.tilt is {fence.tilt:g}; accepted for {name}: {least:.3g} rad or more{need.less}"
        )
    return ManoeuvreRoom(low, high, *_stopping(settings))


def _contract(name: str, vehicle: Vehicle, latency: float) -> Contract:
    mode = COMMAND_MODES["ctbr"]
    low, high = (tuple(map(float, limits)) for limits in command_limits(mode, vehicle))
    action = Action(mode.name, mode.fields, mode.units, low, high)
    hover = tuple(map(float, action.asking(np.array([GRAVITY, 0.0, 0.0, 0.0]))))
    return Contract(
        contract_version=CONTRACT_VERSION, e2efly_version=__version__, task=name, vehicle=vehicle.name,
        vehicle_hash=vehicle.hash, control_rate_hz=CONTROL_RATE, latency_s=latency, latency_range_s=(latency, latency),
        observation_latency_range_s=(0.0, 0.0), observation=(_ELAPSED, _PLACE, ATTITUDE, VELOCITY), images=(),
        memory_size=_MEMORY, action=action, hover_action=hover,
    )  # fmt: skip


_MEMORY = 8


def _memory(progress: ManoeuvreProgress) -> np.ndarray:
    p = progress
    return np.array([*p.centre, p.yaw, p.leg, p.since, p.trim, p.time])


def _progress(memory: np.ndarray) -> ManoeuvreProgress:
    yaw, leg, since, trim, time = (float(x) for x in memory[3:])
    return ManoeuvreProgress(np.asarray(memory[:3]), yaw, int(leg), since, trim, time)
