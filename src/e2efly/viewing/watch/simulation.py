"""A policy in the training simulator, with user interventions: wind, mass, thrust, delay, throws, a moved goal.

The interventions are passed to one compiled program as numbers, so that nothing is compiled again during the flight.
"""

from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from e2efly.config import TaskConfig
from e2efly.config.drawing import Face
from e2efly.environment import Env, EnvState, random_key
from e2efly.environment.episodes import Act
from e2efly.environment.stress_rows import with_longer_queue
from e2efly.simulation.device import fast_compile, wide_vectors
from e2efly.simulation.scenes.faces import bodies
from e2efly.vehicles.vehicle import Vehicle
from e2efly.viewing.image_plots import in_colours
from e2efly.viewing.watch.stage import Stage, StageFrame

HELD = ("mass", "inertia", "thrust_map")
"""Parameters of the vehicle that the user can change."""
LATEST = 0.2
"""Largest delay that can be set, s."""
THROW_SPEED, THROW_RATE = 3.0, 8.0
"""Standard deviations of a throw per axis: velocity, m/s, and body rate, rad/s."""
LAST = 100
"""Number of recent episodes over which the success rate is shown."""


def stage(vehicle: Vehicle, task: TaskConfig, scene: Any, world: int) -> Stage:
    """The stage of one world of a task.

    Args:
        vehicle: the vehicle that is drawn.
        task: the options of the task, for one criterion.
        scene: the worlds, from the task's simulation class.
        world: index of the world.
    """
    solids = bodies(scene, world, ceilings=True)
    drawn = task.drawing() or ()
    return Stage(vehicle, solids, [thing for thing in drawn if not (solids and isinstance(thing, Face))])  # or twice


def moment(env: Env, task: TaskConfig, state: EnvState, row: int) -> tuple[Stage, StageFrame]:
    """One vehicle of a batch in its world, to be drawn, and after it the others of this world."""
    s, goal, first = state.vehicle, env.task.goal(state.memory, state.time), row - row % env.agents
    each = [row, *(i for i in range(first, first + env.agents) if i != row)]
    there = (s.position, s.quaternion, s.velocity, s.rotor_speed, goal)
    position, quaternion, velocity, rotor_speed, aim = (np.asarray(x, float)[each] for x in there)
    frame = StageFrame(float(state.time[row]), position, quaternion, velocity, rotor_speed, aim, together=env.agents)
    return stage(env.physics.flown, task, env.task.scene(state.memory), row), frame


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Hands:
    """The interventions that act on all vehicles. NaN: the value that was drawn for the episode."""

    wind: Float[Array | np.ndarray, "3"] = field(default_factory=lambda: np.full(3, np.nan, np.float32))
    """Wind, world, m/s."""
    mass: float = np.nan
    """Mass and inertia relative to the vehicle file."""
    thrust: float = np.nan
    """Thrust of the rotors at a given speed, relative to the vehicle file."""
    delay: float = np.nan
    """Delay from observation to command, s, at most `LATEST`."""


def held(env: Env) -> Env:
    """The environment prepared for `Hands`. The same compiled programs fly it with any interventions."""
    env = with_longer_queue(env)
    widths = {name: env.randomize.get(name, 0.0) for name in sorted({*HELD, *env.randomize})}
    wind = 0.0 if env.wind is None else env.wind
    frames = int(np.ceil(LATEST / env.control_period)) + 2
    return replace(env, randomize=widths, wind=wind, queue=max(env.queue, frames))


def under(env: Env, state: EnvState, hands: Hands) -> EnvState:
    """The state of n vehicles with the interventions applied."""

    def chosen(own: Array, wanted: Any) -> Array:
        wanted = jnp.broadcast_to(jnp.asarray(wanted, own.dtype), own.shape)
        return jnp.where(jnp.isnan(wanted), own, wanted)

    flown = env.physics.flown
    n = state.time.shape[0]
    plant = dict(state.plant)
    for name, factor in (("mass", hands.mass), ("inertia", hands.mass), ("thrust_map", hands.thrust)):
        value = jnp.asarray(getattr(flown, name), plant[name].dtype)
        plant[name] = chosen(plant[name], jnp.broadcast_to(value, plant[name].shape) * factor)
    assert state.wind is not None
    wind = chosen(state.wind, jnp.broadcast_to(hands.wind, (n, 3)))
    return replace(state, plant=plant, wind=wind, action_latency=chosen(state.action_latency, hands.delay))


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Push:
    """The changes to the states of n vehicles in one step."""

    shift: Float[Array | np.ndarray, "3"]
    """Shift of the positions, m."""
    speed: Float[Array | np.ndarray, "n 3"]
    """Added to the velocities, world, m/s."""
    rate: Float[Array | np.ndarray, "n 3"]
    """Added to the body rates, rad/s."""


def _pushed(state: EnvState, push: Push) -> EnvState:
    s = state.vehicle
    s = replace(
        s, position=s.position + push.shift, velocity=s.velocity + push.speed, body_rate=s.body_rate + push.rate
    )
    if s.load is not None:
        s = replace(s, load=replace(s.load, position=s.load.position + push.shift))
    past = state.past
    if past is not None:
        past = replace(past, position=past.position + push.shift)
    return replace(state, vehicle=s, past=past)


def _advance(
    env: Env, state: EnvState, action: Array, hands: Hands, push: Push
) -> tuple[EnvState, Array, dict[str, Array]]:
    state = under(env, _pushed(state, push), hands)
    reached, out = env.step(state, action)
    s = reached.vehicle
    seen = {
        "position": s.position, "quaternion": s.quaternion, "velocity": s.velocity, "rotor_speed": s.rotor_speed,
        "body_rate": s.body_rate, "goal": env.task.goal(reached.memory, reached.time), "time": reached.time,
        "command": env.command(action), "done": out.done, "success": out.success,
    }  # fmt: skip
    if s.load is not None:
        seen["load"] = s.load.position
    return reached, out.observation, seen


@dataclass
class Simulation:
    """A source of frames: n vehicles, each of which flies one episode after the other."""

    env: Env
    """Environment of the criterion that is flown."""
    vehicle: Vehicle
    """The vehicle that is drawn."""
    task: TaskConfig
    """Task options of the criterion."""
    act: Act
    """The policy. It may be replaced by another policy of the same kind at any time."""
    count: int
    """Number of vehicles, or a few more for whole worlds of several."""
    seed: int = 0
    """Seed of the starts."""
    hands: Hands = field(default_factory=Hands)
    """Interventions on the vehicles. They may be replaced at any time."""

    def __post_init__(self) -> None:
        self.env = held(self.env)
        self.count = self.env.whole(self.count)
        self.period = self.env.control_period
        options = wide_vectors(self.count) | ({} if self.env.cameras else fast_compile())
        self._step = jax.jit(_advance, compiler_options=options)
        self._begin = jax.jit(partial(Env.reset, n=self.count), compiler_options=options)
        self._random = np.random.default_rng(self.seed)
        self._ends: list[bool] = []
        self._origin = np.zeros(3)  # of the task's world in the viewer's: a moved goal moves the world
        self._stage: tuple[int, Stage] | None = None
        self._push = self._none()
        self.begin()

    def begin(self) -> None:
        """Start all episodes anew, each from a new start."""
        self._state, observation = self._begin(self.env, random_key(int(self._random.integers(1 << 31))))
        self._observation = np.asarray(observation)
        self._memory = self.act.begin(self.count)
        self._ends, self._began = [], True
        if self.env.cameras or self.task.own_worlds:
            self._stage = None

    def throw(self) -> None:
        """Push and spin all vehicles at random."""
        rate = THROW_RATE * self._random.standard_normal((self.count, 3)).astype(np.float32)
        speed = THROW_SPEED * self._random.standard_normal((self.count, 3)).astype(np.float32)
        self._push = replace(self._push, speed=speed, rate=rate)

    def move(self, by: np.ndarray) -> None:
        """Move the goal, and the task's world with it, by (3,) m. The vehicles stay where they are.

        A policy sees positions only relative to its goal. Moving the goal is therefore the same as moving the world.
        """
        self._origin = self._origin + by
        self._push = replace(self._push, shift=self._push.shift - np.asarray(by, np.float32))

    @property
    def levels(self) -> bool:
        """Whether the goal may only be moved horizontally, because there are obstacles, or the ground to land on."""
        return bool(self.env.cameras) or getattr(self.env.task, "lands", False) or bool(self._scene().kinds)

    def step(self, followed: int) -> StageFrame:
        """The frame after the next control step."""
        images = tuple(np.asarray(image) for image in self._state.images)
        action, self._memory = self.act.act(self._observation, images, self._memory)
        push, self._push = self._push, self._none()
        self._state, observation, seen = self._step(self.env, self._state, jnp.asarray(action), self.hands, push)
        self._observation = np.asarray(observation)
        seen = {name: np.asarray(value) for name, value in seen.items()}
        done = seen["done"]
        if done.any():
            self._memory = np.where(done[:, None], np.asarray(self.act.begin(self.count)), np.asarray(self._memory))
            self._ends = [*self._ends, *seen["success"][done].tolist()][-LAST:]
        fresh = bool(done[followed]) or self._began
        self._began = False
        if done[followed] and (self.env.cameras or self.task.own_worlds):
            self._stage = None  # it has another world now; the other vehicles' worlds stay and need not be drawn again
        return StageFrame(
            time=float(seen["time"][followed]),
            position=seen["position"] + self._origin,
            quaternion=seen["quaternion"],
            velocity=seen["velocity"],
            rotor_speed=seen["rotor_speed"],
            goal=seen["goal"] + self._origin,
            load=seen["load"] + self._origin if "load" in seen else None,
            images=self._images(followed),
            series=self._series(followed, seen),
            fresh=fresh,
            together=self.env.agents,
            note=self._note(followed, seen),
        )

    @property
    def origin(self) -> np.ndarray:
        """Origin of the task's world in the viewer's world, (3,) m."""
        return self._origin

    def goal_now(self, followed: int) -> np.ndarray:
        """Current goal position of a vehicle, (3,) m."""
        state = self._state
        return np.asarray(self.env.task.goal(state.memory, state.time))[followed] + self._origin

    def stage_of(self, followed: int) -> Stage:
        """The stage of a vehicle's world, in the task's own coordinates. It is the same object until it changes."""
        if self._stage is None or self._stage[0] != followed:
            self._stage = followed, stage(self.vehicle, self.task, self._scene(), followed)
        return self._stage[1]

    def _scene(self) -> Any:
        return self.env.task.scene(self._state.memory)

    def _none(self) -> Push:
        return Push(np.zeros(3, np.float32), *np.zeros((2, self.count, 3), np.float32))

    def _images(self, followed: int) -> dict[str, np.ndarray]:
        return {
            f"{camera.sees} {i}": in_colours(camera.sees, np.asarray(image[followed]), camera.reach[1])
            for i, (camera, image) in enumerate(zip(self.env.cameras, self._state.images, strict=True))
        }

    def _series(self, followed: int, seen: dict[str, np.ndarray]) -> dict[str, tuple[float, ...]]:
        found: dict[str, tuple[float, ...]] = {"speed (m/s)": (float(np.linalg.norm(seen["velocity"][followed])),)}
        if self.env.physics.command_mode == "ctbr":
            command, rate = seen["command"][followed], seen["body_rate"][followed]
            for i, axis in enumerate(("roll", "pitch", "yaw")):
                found[f"{axis} rate (rad/s)"] = float(command[1 + i]), float(rate[i])
        return found

    def _note(self, followed: int, seen: dict[str, np.ndarray]) -> str:
        off = np.linalg.norm(seen["goal"][followed] - seen["position"][followed])
        told = f"{seen['time'][followed]:.1f} s, {np.linalg.norm(seen['velocity'][followed]):.1f} m/s, "
        told += f"{off:.2f} m from its goal"
        if self._ends:
            share = 100 * float(np.mean(self._ends))
            told += f"\n{share:.0f} % of the last {len(self._ends)} episodes succeeded"
        changed = [
            f"{name} {100 * value:.0f} %"
            for name, value in (("mass", self.hands.mass), ("thrust", self.hands.thrust))
            if np.isfinite(value)
        ]
        return f"{told}\nchanged: {', '.join(changed)}" if changed else told
