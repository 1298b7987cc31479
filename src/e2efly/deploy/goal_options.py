"""The goal of a policy: what its contract asks for, where the options put it. The defaults are the training's."""

import dataclasses
from dataclasses import dataclass
from typing import Any

import numpy as np

from e2efly.courses import defaults
from e2efly.courses.gates import Gates
from e2efly.courses.origin import Origin
from e2efly.courses.references import LONGEST, Lissajous, Spline, knot_count, read_csv, through_points
from e2efly.courses.tracks import load_track
from e2efly.deploy.contract import Contract
from e2efly.deploy.goals import GatesGoal, Goal, HoverGoal, LandGoal, ReferenceGoal
from e2efly.vehicles import Vehicle, unknown
from e2efly.vehicles.tables import LARGEST


@dataclass(frozen=True)
class GoalOptions:
    """Where to fly. Options of another task than the policy's are refused."""

    target: tuple[float, float, float] = defaults.TARGET
    """hover: where to, m."""
    pad: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """land: the point of the ground to land on, m."""
    reference: str = "circle"
    """track: circle, lemniscate, or the path of a .csv file with columns t, x, y, z."""
    centre: tuple[float, float, float] = defaults.CENTRE
    """track: centre of circle and lemniscate, m."""
    radius: float = defaults.RADIUS
    """track: radius of the circle, half the length of the lemniscate, m."""
    circle_rate: float = defaults.CIRCLE_RATE
    """track: angular rate of the circle, rad/s; negative: clockwise."""
    lemniscate_speed: float = defaults.LEMNISCATE_SPEED
    """track: top speed of the lemniscate, m/s."""
    phase: float = 0.0
    """track: where on circle or lemniscate to begin, rad."""
    duration: float = 20.0
    """track: how long circle and lemniscate go on, s; then their end is held."""
    track: str = defaults.TRACK
    """race: four_gates, s_shaped, circle_3d, j_shaped, or the path of a .toml file."""
    laps: int = 1
    """race: laps to fly; 0: on and on."""
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Where the origin of all these lies in the room (the world of the pose source), m."""
    origin_yaw: float = 0.0
    """By how much their x axis is turned from the room's about up, rad."""


SMALLEST = 1e-3
"""Smallest radius, speed and duration of circle and lemniscate, in their units."""
_CURVE = ("centre", "radius", "phase", "duration")
_OPTIONS: dict[str, tuple[str, ...]] = {
    "hover": ("target",),
    "land": ("pad",),
    "track": ("reference", "circle_rate", "lemniscate_speed", *_CURVE),
    "race": ("track", "laps"),
}
"""The options of each task, besides the origin."""
_REFERENCES: dict[str, tuple[str, ...]] = {
    "circle": ("circle_rate", *_CURVE),
    "lemniscate": ("lemniscate_speed", *_CURVE),
}
"""The options of each kind of reference but a file."""


def goal_for(contract: Contract, options: GoalOptions, vehicle: Vehicle) -> Goal:
    """The goal that a policy was trained to fly to, where the options say.

    Args:
        contract: the policy's; its task and its observation fields choose the goal.
        options: where to fly.
        vehicle: that flies: its feet and its size count.

    Raises:
        ValueError: naming the option or the observation field, what it is and what is accepted: a number out of
            range, an option of another task, a goal under the ground, a course that does not exist or is broken, or
            a policy that sees another field than its task's.
    """
    if contract.task not in _OPTIONS:
        raise ValueError(unknown("task of the policy", contract.task, _OPTIONS))
    _check_numbers(options)
    _check_use(contract, options)
    origin = Origin(options.origin, options.origin_yaw)
    goal = _MAKERS[contract.task](options, origin, vehicle)
    fields = {f.name: f.size for f in contract.observation}
    if fields.get(goal.field) != goal.size:
        raise ValueError(
            f"observation of the policy is {fields}; accepted: with {goal.field!r} of size {goal.size}, as its task "
            f"is {contract.task!r}"
        )
    return goal


def _hover(options: GoalOptions, origin: Origin, vehicle: Vehicle) -> Goal:
    target = origin.points(options.target)
    _above("target", target[2], vehicle.feet_height)
    return HoverGoal(target, defaults.HOVER_FENCE)


def _land(options: GoalOptions, origin: Origin, vehicle: Vehicle) -> Goal:
    return LandGoal(origin.points(options.pad), vehicle.feet_height, defaults.LAND_FENCE)


def _track(options: GoalOptions, origin: Origin, vehicle: Vehicle) -> Goal:
    o = options
    if o.reference == "circle":
        spline = _curve(Lissajous.circle(o.radius, o.circle_rate), o)
    elif o.reference == "lemniscate":
        spline = _curve(Lissajous.lemniscate(o.radius, o.lemniscate_speed), o)
    elif o.reference.endswith(".csv"):
        spline = through_points(read_csv(o.reference))
    else:
        raise ValueError(unknown("reference", o.reference, _REFERENCES) + ", or the path of a .csv file")
    placed = origin.spline(spline)
    _above("reference", float(placed.knots[0, :, 0, 2].min()), vehicle.feet_height)
    return ReferenceGoal(placed, defaults.TRACK_FENCE)


def _race(options: GoalOptions, origin: Origin, vehicle: Vehicle) -> Goal:
    track = load_track(options.track)
    if options.laps > 1 and not track.closed:
        raise ValueError(f"goal.laps is {options.laps}; accepted: 0 or 1, as track {track.name!r} is not closed")
    placed = origin.track(track)
    _above("track", float((placed.position[:, 2] - placed.opening[:, 1] / 2).min()), 0.0, "the lowest opening")
    laps = options.laps if track.closed else 1
    return GatesGoal(Gates.of(placed), track.closed, laps, vehicle.radius, defaults.RACE_FENCE)


_MAKERS = {"hover": _hover, "land": _land, "track": _track, "race": _race}


def _curve(curve: Lissajous, options: GoalOptions) -> Spline:
    spline = curve.spline(options.centre, np.array([options.phase]), knot_count(options.duration))
    return dataclasses.replace(spline, end=options.duration)


def _above(name: str, height: float, least: float, what: str = "its lowest centre of mass") -> None:
    if height < least:
        raise ValueError(
            f"goal.{name}: {what} is {height:.3f} m over the ground of the room, with goal.origin; accepted: at least "
            f"{least:g} m"
        )


def _check_numbers(options: GoalOptions) -> None:
    if not SMALLEST <= options.duration <= LONGEST:
        raise ValueError(f"goal.duration is {options.duration}; accepted: {SMALLEST:g} to {LONGEST:g} s")
    for name, value in dataclasses.asdict(options).items():
        numbers = () if isinstance(value, str) else np.ravel(np.asarray(value, object))
        if not all(abs(x) <= LARGEST for x in numbers):  # false for NaN
            raise ValueError(f"goal.{name} is {value}; accepted: finite numbers, at most {LARGEST:g} in size")
    for name in ("target", "pad", "centre", "origin"):
        if len(getattr(options, name)) != 3:
            raise ValueError(f"goal.{name} is {getattr(options, name)}; accepted: three numbers, m")
    for name in ("radius", "lemniscate_speed"):
        if getattr(options, name) < SMALLEST:
            raise ValueError(f"goal.{name} is {getattr(options, name)}; accepted: {SMALLEST:g} or more")
    if options.circle_rate == 0:
        raise ValueError("goal.circle_rate is 0.0; accepted: any rate but 0, rad/s")
    if options.laps < 0:
        raise ValueError(f"goal.laps is {options.laps}; accepted: 0 or more")


def _check_use(contract: Contract, options: GoalOptions) -> None:
    """Refuse what the options say in vain, and what would turn a policy's commands away from its goal."""
    changed: dict[str, Any] = {
        f.name: getattr(options, f.name) for f in dataclasses.fields(options) if getattr(options, f.name) != f.default
    }
    usable = {*_OPTIONS[contract.task], "origin", "origin_yaw"}
    kind = f"the policy's task is {contract.task!r}"
    if contract.task == "track":
        if options.reference in _REFERENCES:
            usable &= {"reference", "origin", "origin_yaw", *_REFERENCES[options.reference]}
        elif options.reference.endswith(".csv"):
            usable &= {"reference", "origin", "origin_yaw"}
        kind += f" and the reference {options.reference!r}"
    for name, value in changed.items():
        if name not in usable:
            raise ValueError(f"goal.{name} is {value!r}, but {kind}; accepted: {', '.join(sorted(usable))}")
    # a policy sees where it is from its goal alone: commands in the world's axes are those of its training's world
    mode = contract.action.mode
    fixed = {"ctbr": (), "position": ("origin", "origin_yaw")}.get(mode, ("origin_yaw",))
    for name in fixed:
        if name in changed:
            raise ValueError(
                f"goal.{name} is {changed[name]!r}; accepted: {getattr(GoalOptions(), name)!r}, as the policy commands "
                f"{mode} in the world of its training: give the pose source that origin instead"
            )
