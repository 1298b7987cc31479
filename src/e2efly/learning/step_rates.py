"""Simulation rates of the three layers (physics, environment, training), each measured in one compiled loop."""

import dataclasses
import time
from collections.abc import Callable, Mapping
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from e2efly.config import TrainConfig
from e2efly.environment import Env, random_key
from e2efly.learning.devices import AXIS, OWN, SAME, on_each, own, placed, share, stacked
from e2efly.learning.programs import start_program
from e2efly.learning.setup import Setup
from e2efly.runs import presets
from e2efly.simulation.physics import Physics, State, step
from e2efly.vehicles.loading import load_vehicle

CALLS = 200
"""Calls of a step in a measured loop."""


def physics_substeps(vehicles: int, plants: Mapping[str, np.ndarray] | None = None) -> float:
    """Physics sub-steps per second of VIS-R under CTBR commands: 10 sub-steps of 5 ms per call, all in one scan.

    `plants`: the parameters of which every vehicle has its own value, (n, ...). The others are constants.
    """
    vehicle = load_vehicle("vis_r")
    physics = Physics.of(vehicle, control_rate=20.0)
    devices = share(vehicles, None, None)
    state = State.hovering(vehicle, jnp.zeros((vehicles, 3), jnp.float32))
    command = (0.5 * np.random.default_rng(0).normal(size=(vehicles, 4)) + np.array([9.81, 0, 0, 0])).astype(np.float32)

    def run(state: State, command: jax.Array, plants: dict[str, Any]) -> State:
        plant = dataclasses.replace(physics.nominal, **plants)
        body = lambda s, _: (step(physics, plant, s, command), None)  # noqa: E731
        return jax.lax.scan(body, state, None, length=CALLS)[0]

    program = on_each(run, devices, (OWN, OWN, OWN), OWN, vehicles=vehicles // devices)
    start = placed((state, command, dict(plants or {})), devices)
    return best_rate(vehicles * CALLS * physics.substeps, lambda: jax.block_until_ready(program(*start)))


def environment_steps(task: str | TrainConfig, envs: int) -> float:
    """Environment steps per second with random actions. Everything is included: latency, reward, new starts,
    randomisation. Each vehicle counts, also of a world with several.
    """
    config = presets.preset(task, "ppo") if isinstance(task, str) else task
    env_config = dataclasses.replace(config.env, randomize={"mass": 0.1, "motor_time_constant": 0.1})
    env = Env.of(config.task, config.reward, env_config)
    devices = share(envs, None, None)
    actions = np.random.default_rng(0).uniform(-0.5, 0.2, (envs, 16, 4)).astype(np.float32)

    def start(env: Env, key: jax.Array) -> Any:
        return stacked(env.reset(jax.random.fold_in(key, jax.lax.axis_index(AXIS)), envs // devices)[0])

    def run(env: Env, state: Any, actions: jax.Array) -> Any:
        def body(carry: Any, i: jax.Array) -> tuple[Any, jax.Array]:
            carry, out = env.step(carry, actions[:, i % 16])
            return carry, jnp.sum(out.observation) + jnp.sum(out.reward)

        return stacked(jax.lax.scan(body, own(state), jnp.arange(CALLS)))

    state = on_each(start, devices, (SAME, SAME), OWN)(env, random_key(0))
    program, actions = on_each(run, devices, (SAME, OWN, OWN), OWN, vehicles=envs // devices), placed(actions, devices)
    return best_rate(envs * CALLS, lambda: jax.block_until_ready(program(env, state, actions)))


def training_steps(config: TrainConfig) -> float:
    """Environment steps per second of training."""
    setup = Setup.of(config)
    parameters = setup.algorithm.init(setup.env, config.algo, 0)

    def run(env: Env, algo: Any, state: Any) -> Any:
        update = lambda state, _: setup.algorithm.update(env, algo, state, jnp.float32(0.5))  # noqa: E731
        return stacked(jax.lax.scan(update, own(state), None, length=5))

    program = on_each(run, setup.devices, (SAME, SAME, OWN), OWN, vehicles=setup.vehicles)
    state = start_program(setup)(setup.env, parameters, random_key(0))
    return best_rate(
        5 * setup.steps_per_update, lambda: jax.block_until_ready(program(setup.env, config.algo, state)), rounds=15
    )


def best_rate(count: int, run: Callable[[], Any], rounds: int = 9) -> float:
    """`count` divided by the shortest time of `run`, after one call that compiles."""
    run()
    times = []
    for _ in range(rounds):
        start = time.perf_counter()
        run()
        times.append(time.perf_counter() - start)
    return count / min(times)
