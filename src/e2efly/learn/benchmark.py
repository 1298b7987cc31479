"""Rates of the three layers, each in one compiled loop: physics, environment, training."""

import dataclasses
import time
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from e2efly import presets
from e2efly.config import BPTTConfig, EnvConfig, NetworkConfig
from e2efly.env import Env, random_key
from e2efly.learn.algorithm import begin
from e2efly.learn.setup import Setup
from e2efly.physics import Physics, State, step
from e2efly.vehicles import load_vehicle


def physics_substeps(vehicles: int, calls: int = 200) -> float:
    """Physics sub-steps/s of VIS-R under CTBR commands: 10 sub-steps of 5 ms a call, all in one scan."""
    vehicle = load_vehicle("vis_r")
    physics = Physics.of(vehicle, control_rate=20.0)
    state = State.hovering(vehicle, jnp.zeros((vehicles, 3), jnp.float32))
    spread = np.random.default_rng(0).normal(size=(vehicles, 4)).astype(np.float32)
    command = jnp.asarray(0.5 * spread + np.array([9.81, 0, 0, 0], np.float32))

    @jax.jit
    def run(state: State, command: jax.Array) -> State:
        return jax.lax.scan(lambda s, _: (step(physics, physics.nominal, s, command), None), state, None, length=calls)[
            0
        ]

    return best_rate(vehicles * calls * physics.substeps, lambda: jax.block_until_ready(run(state, command)))


def environment_steps(task: str, envs: int, steps: int = 200, env_config: EnvConfig | None = None) -> float:
    """Environment steps/s with random actions, everything included: latency, reward, new starts, randomisation."""
    config = presets.preset(task, "ppo")
    env_config = env_config or dataclasses.replace(config.env, randomize={"mass": 0.1, "motor_time_constant": 0.1})
    env = Env.of(config.task, config.reward, env_config)
    actions = jnp.asarray(np.random.default_rng(0).uniform(-0.5, 0.2, (16, envs, 4)).astype(np.float32))

    @jax.jit
    def run(env: Env, state: Any) -> Any:
        def body(carry: Any, i: jax.Array) -> tuple[Any, jax.Array]:
            carry, out = env.step(carry, actions[i % 16])
            return carry, jnp.sum(out.observation) + jnp.sum(out.reward)

        return jax.lax.scan(body, state, jnp.arange(steps))

    state, _ = jax.jit(env.reset, static_argnums=1)(random_key(0), envs)
    return best_rate(envs * steps, lambda: jax.block_until_ready(run(env, state)))


def training_steps(task: str, algo: str, wide: bool = False) -> float:
    """Environment steps/s of training by a preset; `wide`: 100 environments, horizon 96, networks of 192 and 96."""
    config = presets.preset(task, algo)
    if wide and isinstance(config.algo, BPTTConfig):
        algo_config = dataclasses.replace(config.algo, envs=100, horizon=96)
        config = dataclasses.replace(config, algo=algo_config, network=NetworkConfig((192, 96)))
    setup = Setup.of(config)
    key = random_key(0)
    parameters = setup.algorithm.init(setup.env, config.algo, 0)

    @jax.jit
    def run(env: Env, algo: Any, state: Any) -> Any:
        return jax.lax.scan(lambda s, _: setup.algorithm.update(env, algo, s, jnp.float32(0.5)), state, None, length=5)

    state = jax.jit(lambda env, p, key: begin(env, config.algo, p, key))(setup.env, parameters, key)
    return best_rate(
        5 * setup.steps_per_update, lambda: jax.block_until_ready(run(setup.env, config.algo, state)), rounds=5
    )


def best_rate(count: int, run: Callable[[], Any], rounds: int = 9) -> float:
    """`count` over the shortest time of `run`, after one run that compiles."""
    run()
    times = []
    for _ in range(rounds):
        start = time.perf_counter()
        run()
        times.append(time.perf_counter() - start)
    return count / min(times)
