"""Where a policy is to fly: options of `e2efly fly`, and the course that follows from them. Imports no JAX."""

import dataclasses
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from e2efly.config import TaskConfig, check_fields, number
from e2efly.config.domain import Domain
from e2efly.config.registry import load
from e2efly.config.tables import LARGEST
from e2efly.control import COMMAND_MODES
from e2efly.courses.origin import Origin
from e2efly.policy.contract import Contract
from e2efly.policy.goal import Course, Goal, Shape
from e2efly.policy.observation import Field
from e2efly.policy.others import nobody
from e2efly.tasks.registry import TASKS
from e2efly.vehicles.vehicle import Vehicle

UNDECLARED = "The policy does not say for which courses it was trained."
ANYWAY = "accepted: a course within these ranges, or goal.outside (--goal.outside), which flies it all the same"


def place(default: Any) -> Any:
    """A field for positions, angles or rates, which may be negative."""
    return number(default, low=-LARGEST, high=LARGEST)


@dataclass(frozen=True)
class Route:
    """Where a policy is to fly. The defaults fit into a room where the task has such a course."""

    longest_s: ClassVar[float] = 10.0
    """Longest flight of the policy in a rehearsal, s."""
    height: ClassVar[str] = "target"
    """Name of the option that sets the height of the course."""
    whole: ClassVar[dict[str, Any]] = {}
    """Options of a rehearsal that replace the defaults."""
    trained: ClassVar[dict[str, Any]] = {}
    """Options that place the course of the training, where the defaults place another."""

    origin: tuple[float, float, float] = place((0.0, 0.0, 0.0))
    """Position of the task's origin in the room (the world of the pose source), m."""
    origin_yaw: float = place(0.0)
    """Rotation of the task's x axis from the room's x axis about the vertical, rad."""

    outside: bool = False
    """Fly a course also if it lies outside of the ranges that the policy was trained for."""

    @property
    def instead(self) -> str | None:
        """The task whose policy of the zoo flies these options. None: this task."""
        return None

    @property
    def notes(self) -> list[str]:
        """What is to be said of the options before every flight."""
        return []

    def domain(self) -> Domain:
        """The quantities of the course, named as in `TaskConfig.domain`."""
        return ()

    def course(self, shape: Shape, control_period: float) -> Course:
        """The course, for a vehicle of this shape, at this control period in s.

        Raises:
            ValueError: naming the option, its value and what is accepted.
        """
        raise NotImplementedError

    def course_of(self, contract: Contract, shape: Shape) -> Course:
        """The course for a policy. If a task has several kinds of observation, the course uses that of this policy."""
        course = self.course(shape, 1 / contract.control_rate_hz)
        goal, memory = course.goal.shown_to([field.name for field in contract.observation]), course.memory
        if course.goal.neighbours:
            goal = dataclasses.replace(goal, config=dataclasses.replace(goal.config, neighbours=contract.neighbours))
            memory = course.goal.among(memory, nobody(np.atleast_2d(course.start), contract.neighbours))
        return dataclasses.replace(course, goal=goal, memory=memory)

    @classmethod
    def drawn(cls, course: Course, file: Path) -> "Route":
        """The options that give a course which a training environment has drawn.

        If the options need a file, a track, it is written to the path of a .toml file.

        Raises:
            OSError: when the file cannot be written.
        """
        return cls()

    def unused(self) -> tuple[str, ...]:
        """Names of the options that have no effect because of the value of another option."""
        return ()


def route_of(contract: Contract) -> type[Route]:
    """The class of route options for the task of a policy.

    Raises:
        ValueError: for a task that cannot be found, or a task that has no route.
    """
    task = TASKS.find(contract.task)
    route = _of_its_world(task, "route")
    if route is None:
        able = ", ".join(name for name, options in TASKS.items() if options.route is not None)
        raise ValueError(f"task {contract.task!r} of the policy has no route; accepted: {able}, or a task with a route")
    return route


def usual_route(contract: Contract) -> Route:
    """The route that a policy flies unless another is given."""
    kind, fixed = route_of(contract), COMMAND_MODES[contract.action.mode].fixed
    return kind(**{name: value for name, value in kind.trained.items() if name in fixed})


def goal_of(task: type[TaskConfig]) -> type[Goal]:
    """The class that computes a policy's task observation and judges it.

    It works without JAX if the task provides such a class.
    """
    return _of_its_world(task, "goal_class") or _of_its_world(task, "world")


def _of_its_world(task: type[TaskConfig], name: str) -> Any:
    """A class variable, or the object that its reference names.

    None if it belongs to a parent task whose world this task replaces.
    """
    parents = task.__mro__
    world, there = (next(i for i, kind in enumerate(parents) if n in vars(kind)) for n in ("world", name))
    found = getattr(task, name) if there <= world else None
    return load(found) if isinstance(found, str) else found


def fields_of(contract: Contract) -> tuple[Field, ...]:
    """The task's own fields in the observation of a policy.

    Raises:
        ValueError: for a task that cannot be found.
    """
    goal, names = goal_of(TASKS.find(contract.task)), [field.name for field in contract.observation]
    goal = goal.showing(names) if hasattr(goal, "showing") else goal
    if getattr(goal, "neighbours", Goal.neighbours) is not Goal.neighbours:
        shape = Shape(feet_height=0.0, radius=0.0)  # no field depends on it
        return usual_route(contract).course_of(contract, shape).goal.fields
    if not goal.observation:
        return goal.fields  # type: ignore[return-value]
    options = dataclasses.replace(TASKS.find(contract.task)().showing(names), observes=tuple(names))
    return tuple(field for field, _ in goal.observation if options.shows(field.name))


def course_for(contract: Contract, vehicle: Vehicle, route: Route | None = None) -> Course:
    """The course that a policy is to fly, at the place that the options give.

    Without a route, it is the usual one. The vehicle matters by its feet height and its size.

    Raises:
        ValueError: naming the option, its value and what is accepted: a number out of range, an option without effect,
            a goal under the ground, a course that does not exist or is broken, or that the policy was not trained for.
    """
    kind = route_of(contract)
    route = usual_route(contract) if route is None else route
    if not isinstance(route, kind):
        raise ValueError(f"goal is a {type(route).__name__}; accepted: a {kind.__name__}, for task {contract.task!r}")
    check_fields("goal", route)
    _check_use(contract, route)
    shape = Shape(vehicle.feet_height, vehicle.radius)
    course = route.course_of(contract, shape)
    origin = Origin(route.origin, route.origin_yaw)
    placed = dataclasses.replace(course, origin=origin.at(course.origin))
    if not route.outside and (reasons := contract.outside(route.domain())):
        raise ValueError("\n".join([*(f"goal: {reason}" for reason in reasons), ANYWAY]))
    least = vehicle.feet_height if course.clearance is None else course.clearance
    height = float(placed.origin.points(np.reshape(course.points, (-1, 3)))[:, 2].min(initial=math.inf))
    if height < least:
        raise ValueError(
            f"goal.{route.height}: its lowest point is {height:.3f} m over the ground of the room, with goal.origin; "
            f"accepted: at least {least:g} m"
        )
    return placed


def goal_notes(contract: Contract, route: Route | None) -> list[str]:
    """What is to be said of a course: of its options, and if the policy was not, or may not be, trained for it."""
    route = usual_route(contract) if route is None else route
    if contract.courses is None:
        return [*route.notes, UNDECLARED]
    return [*route.notes, *(f"Outside of the training: {text}." for text in contract.outside(route.domain()))]


def _check_use(contract: Contract, route: Route) -> None:
    """Refuse options without effect, and changes of frame that a command in world axes would not follow."""
    changed = {f.name: getattr(route, f.name) for f in dataclasses.fields(route) if getattr(route, f.name) != f.default}
    useless = route.unused()
    usable = sorted(f.name for f in dataclasses.fields(route) if f.name not in useless)
    for name, value in changed.items():
        if name in useless:
            raise ValueError(f"goal.{name} is {value!r}, but has no effect here; accepted: {', '.join(usable)}")
    # a policy knows its position only relative to its goal: commands in world axes refer to the world of its training
    mode = contract.action.mode
    for name in COMMAND_MODES[mode].fixed:
        value, default = (getattr(x, name, None) for x in (route, usual_route(contract)))
        if value != default:
            raise ValueError(
                f"goal.{name} is {value!r}; accepted: {default!r}, as the policy commands {mode} in the world "
                "of its training: give the pose source that origin instead"
            )
