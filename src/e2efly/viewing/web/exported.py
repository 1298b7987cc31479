"""An environment as data for the page: its own step as a program, the starts of its episodes, and what is drawn."""

import dataclasses
from collections.abc import Mapping
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from e2efly.config import TaskConfig
from e2efly.config.drawing import Face, Line, Mark
from e2efly.environment import UNSEEN, Env, EnvState, random_key
from e2efly.simulation.device import fast_compile
from e2efly.simulation.scenes.faces import FacesBody
from e2efly.validation.evaluation import SEED
from e2efly.viewing.watch.simulation import LATEST, Hands, held, stage, under
from e2efly.viewing.watch.stage import Stage
from e2efly.viewing.web.lowering import lowered
from e2efly.viewing.web.machine import packed

STARTS = 12
"""Number of starts of each course."""
POINTS = 241
"""Number of points of the drawn path of a goal, and of what is thrown."""
UNDER = 1e3
"""Depth under its place at which something that is not visible is kept, m."""
NOISY = ("gyro_noise", "accel_noise", "gyro_bias", "accel_bias")
"""Options of an IMU that make it noisy."""
HANDS = tuple(f.name for f in dataclasses.fields(Hands))
"""The conditions that the visitor sets."""


def still(env: Env) -> Env:
    """The environment that the page simulates: the vehicle of the file, its delay, still air, and nothing random except
    the starts. For a family, the vehicle in the middle of its ranges.
    """
    env = dataclasses.replace(env, family=None, noise=None).undisturbed()
    imu = env.imu and dataclasses.replace(env.imu, **dict.fromkeys(NOISY, 0.0))
    late = np.full_like(env.observation_latency_range, np.mean(env.observation_latency_range))
    exact: Any = {"disturbance": None, "estimate": None, "link": None, "lost_rotor": None}
    return held(dataclasses.replace(env, imu=imu, observation_latency_range=late, **exact))


def beginnings(env: Env, starts: int) -> EnvState:
    """The starts of a course."""
    begun = jax.jit(lambda env, key: env.reset(key, starts)[0], compiler_options=fast_compile())
    return begun(env, random_key(SEED, UNSEEN, 0))


def course(env: Env, task: TaskConfig, starts: int = STARTS) -> dict[str, Any]:
    """A criterion as JSON.

    Args:
        env: its environment, of `still`.
        task: its options.
        starts: number of starts.

    Raises:
        ValueError: for a task whose step computes with an operation that the page does not have, and for a load.
    """
    if env.action_size != 4:
        raise ValueError(
            f"env.command_mode is {env.physics.command_mode!r} with {env.action_size} rotors; accepted: four commands, "
            "as a page flies"
        )
    if env.payload is not None:
        raise ValueError(f"env.payload has mass {env.payload.mass}; accepted: 0, 0, as a page shows no load")
    agents = env.agents
    begun = beginnings(env, starts * agents)
    worlds = [_world(begun, i, agents) for i in range(starts)]
    first = worlds[0]
    given = named(first)
    hands = {f"hands.{name}": np.asarray(value, np.float32) for name, value in vars(Hands()).items()}
    action = {"action": np.zeros((agents, 4), np.float32)}
    body = env.physics.flown
    scenes = [_seen(env, task, world) for world in worlds]
    kinds = [scene for i, scene in enumerate(scenes) if scene not in scenes[:i]]
    return {
        "agents": agents,
        "period": env.control_period,
        "latency": float(env.latency_range[0]),
        "latest": LATEST,
        "vehicle": {name: plain(getattr(body, name)) for name in ("rotor_position", "rotor_spin", "feet_height")},
        "look": lowered(lambda given: _look(env, _filled(first, given)), given),
        "step": lowered(lambda given: _step(env, _filled(first, given), given), given | hands | action),
        "starts": [
            {
                "state": {name: packed(np.asarray(x), "<f8") for name, x in named(world).items()},
                "scene": kinds.index(scene),
            }
            for world, scene in zip(worlds, scenes, strict=True)
        ],
        "scenes": kinds,
    }


def named(state: EnvState) -> dict[str, Array]:
    """The numbers of a state by name, without the random key and the count of steps."""
    rest = dataclasses.replace(state, key=None, tick=None, images=(), eyes=())
    leaves, _ = jax.tree_util.tree_flatten_with_path(rest)
    return {jax.tree_util.keystr(path, simple=True, separator="."): leaf for path, leaf in leaves}


def _filled(state: EnvState, given: Mapping[str, Array]) -> EnvState:
    """The state with other numbers. Its key and its count of steps stay, so that nothing is random."""
    rest = dataclasses.replace(state, key=None, tick=None, images=(), eyes=())
    structure = jax.tree.structure(rest)
    filled = jax.tree.unflatten(structure, [given[name] for name in named(state)])
    return dataclasses.replace(filled, key=state.key, tick=state.tick, images=state.images, eyes=state.eyes)


def _world(state: EnvState, i: int, agents: int) -> EnvState:
    """One world of a batch: the rows of its vehicles."""
    one = jax.tree.map(lambda x: x[i * agents : (i + 1) * agents], dataclasses.replace(state, key=None, tick=None))
    return dataclasses.replace(one, key=state.key, tick=state.tick)


def _look(env: Env, state: EnvState) -> dict[str, Array]:
    """What the policy of each vehicle observes, and where the vehicle is to be."""
    return {"observation": env._observe(state), "goal": env.task.goal(state.memory, state.time)}


def _step(env: Env, state: EnvState, given: Mapping[str, Any]) -> dict[str, Array]:
    """The next state, and the outcome. `why.NAME` is a signal of the task that is true or false."""
    before = under(env, state, Hands(**{name: given[f"hands.{name}"] for name in HANDS}))
    reached, out = env.step(before, given["action"], restart=False)
    late = env.is_over(reached.time)
    _, outcome = env.task.advance(before.memory, before.vehicle, reached.vehicle, reached.time, late)
    why = {f"why.{name}": x for name, x in outcome.signals.items() if x.dtype == jnp.bool_}
    judged = {name: getattr(outcome, name) for name in ("success", "arrived", "crashed", "error")}
    return named(reached) | judged | why | {"terminated": out.terminated, "truncated": out.truncated}


def _seen(env: Env, task: TaskConfig, state: EnvState) -> dict[str, Any]:
    """What is drawn of a course, as JSON: solids, and lines, faces and marks of the task."""
    shown: Stage = stage(env.physics.flown, task, env.task.scene(state.memory), 0)
    lines = [thing.points for thing in shown.things if isinstance(thing, Line)]
    if task.drawing() is None:
        times = jnp.linspace(0.0, jnp.asarray(env.task.episode_s), POINTS)
        goals = jax.vmap(lambda time: env.task.goal(state.memory, jnp.broadcast_to(time, (env.agents,))))(times)
        lines += [path for path in np.moveaxis(np.asarray(goals), 1, 0) if np.ptp(path, axis=0).max() > 0.01]
    return {
        "solids": [_solid(body, float(env.task.episode_s)) for body in shown.bodies],
        "lines": [plain(points) for points in lines],
        "faces": [plain(x.points) for x in shown.things if isinstance(x, Face)],
        "marks": [{"point": plain(x.point), "text": x.text} for x in shown.things if isinstance(x, Mark) and x.text],
    }


def _solid(body: FacesBody, episode_s: float) -> dict[str, Any]:
    """A solid as JSON. It may move along a path, relative to whose first point its faces are.

    One round of what is thrown takes an episode, s. While it is not visible, it is under the ground.
    """
    drawn = {"colour": plain(body.colour), "label": body.label}
    if not body.moves or body.path is not None:
        moving = {} if body.path is None else {"path": plain(body.path), "rate": body.rate}
        return {"quads": packed(body.quads), **drawn, **moving}
    times = np.linspace(0.0, episode_s, POINTS)
    path = np.array([body.moved(t) + (0.0 if body.visible(t) else np.array([0.0, 0.0, -UNDER])) for t in times])
    return {"quads": packed(body.quads + path[0]), **drawn, "path": plain(path), "rate": 2 * np.pi / episode_s}


def plain(value: Any) -> Any:
    """An array as nested lists of numbers with five decimals, for drawings: to 0.01 mm."""
    return np.asarray(value, float).round(5).tolist()
