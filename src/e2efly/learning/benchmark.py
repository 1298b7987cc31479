"""Simulation rates of the three layers (physics, environment, training), each measured in one compiled loop."""

import dataclasses
import time
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from e2efly.config import EnvConfig, NetworkConfig
from e2efly.environment import Env, random_key
from e2efly.learning.devices import AXIS, OWN, SAME, on_each, own, placed, share, stacked
from e2efly.learning.programs import start_program
from e2efly.learning.setup import Setup
from e2efly.runs import presets
from e2efly.simulation.physics import Physics, State, step
from e2efly.vehicles.loading import load_vehicle
from e2efly.vehicles.vehicle import quantities


def physics_substeps(vehicles: int, calls: int = 200, general: bool = False) -> float:
    """Physics sub-steps per second of VIS-R under CTBR commands: 10 sub-steps of 5 ms per call, all in one scan.

    With `general`, every vehicle has its own value of every parameter. Otherwise the parameters are constants of the
    program.
    """
    vehicle = load_vehicle("vis_r")
    physics = Physics.of(vehicle, control_rate=20.0)
    devices = share(vehicles, None, None)
    state = State.hovering(vehicle, jnp.zeros((vehicles, 3), jnp.float32))
    rng = np.random.default_rng(0)
    command = (0.5 * rng.normal(size=(vehicles, 4)) + np.array([9.81, 0, 0, 0])).astype(np.float32)
    plants: dict[str, Any] = {}
    for name in (field.name for field in quantities() if general):
        value = np.asarray(getattr(physics.nominal, name))
        plants[name] = (value * rng.uniform(0.9, 1.1, (vehicles, *value.shape))).astype(np.float32)

    def run(state: State, command: jax.Array, plants: dict[str, Any]) -> State:
        plant = dataclasses.replace(physics.nominal, **plants)
        body = lambda s, _: (step(physics, plant, s, command), None)  # noqa: E731
        return jax.lax.scan(body, state, None, length=calls)[0]

    program = on_each(run, devices, (OWN, OWN, OWN), OWN, vehicles=vehicles // devices)
    start = placed((state, command, plants), devices)
    return best_rate(vehicles * calls * physics.substeps, lambda: jax.block_until_ready(program(*start)))


def environment_steps(task: str, envs: int, steps: int = 200, env_config: EnvConfig | None = None) -> float:
    """Environment steps per second with random actions. Everything is included: latency, reward, new starts,
    randomisation.
    """
    config = presets.preset(task, "ppo")
    env_config = env_config or dataclasses.replace(config.env, randomize={"mass": 0.1, "motor_time_constant": 0.1})
    env = Env.of(config.task, config.reward, env_config)
    devices = share(envs, None, None)
    actions = np.random.default_rng(0).uniform(-0.5, 0.2, (envs, 16, 4)).astype(np.float32)

    def start(env: Env, key: jax.Array) -> Any:
        return stacked(env.reset(jax.random.fold_in(key, jax.lax.axis_index(AXIS)), envs // devices)[0])

    def run(env: Env, state: Any, actions: jax.Array) -> Any:
        def body(carry: Any, i: jax.Array) -> tuple[Any, jax.Array]:
            carry, out = env.step(carry, actions[:, i % 16])
            return carry, jnp.sum(out.observation) + jnp.sum(out.reward)

        return stacked(jax.lax.scan(body, own(state), jnp.arange(steps)))

    state = on_each(start, devices, (SAME, SAME), OWN)(env, random_key(0))
    program, actions = on_each(run, devices, (SAME, OWN, OWN), OWN, vehicles=envs // devices), placed(actions, devices)
    return best_rate(envs * steps, lambda: jax.block_until_ready(program(env, state, actions)))


_OWN = (
    "mass", "inertia", "rotor_position", "thrust_map", "torque_ratio", "motor_time_constant", "drag_linear",
    "drag_quadratic",
)  # fmt: skip
GENERAL = dict.fromkeys(_OWN, 0.1)
"""Relative ranges of the parameters that are drawn anew in every episode, so that every vehicle is different."""


def training_steps(task: str, algo: str, wide: bool = False, general: bool = False, device: str = "cpu") -> float:
    """Environment steps per second of training with the preset nominal, in its sizes for a device.

    With `wide`: 100 environments, horizon 96, networks with 192 and 96 units. With `general`: every vehicle has its own
    parameters.
    """
    config = presets.starting(task, algo, presets.NOMINAL, device=device)
    if general:
        config = dataclasses.replace(config, env=dataclasses.replace(config.env, randomize=GENERAL))
    if wide and config.algo.exact:
        algo_config = dataclasses.replace(config.algo, envs=100, horizon=96)
        config = dataclasses.replace(config, algo=algo_config, network=NetworkConfig((192, 96)))
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
