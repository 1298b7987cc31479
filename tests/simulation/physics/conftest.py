"""What the physics tests share: one compiled flight, and random states."""

import dataclasses
from collections.abc import Callable
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from e2efly.control.vectors import Vec3
from e2efly.simulation.physics import INTEGRATORS, Physics, State, step
from e2efly.simulation.physics.airframe import Airframe
from e2efly.simulation.physics.state import Parts, split
from e2efly.vehicles.vehicle import Vehicle, quantities

Fly = Callable[..., State]


@pytest.fixture(scope="session")
def vacuum(vis_r: Vehicle) -> Vehicle:
    """VIS-R without drag."""
    return dataclasses.replace(vis_r, drag_linear=np.zeros(3), drag_quadratic=np.zeros(3))


@pytest.fixture(scope="session")
def stone(vacuum: Vehicle) -> Vehicle:
    """VIS-R whose rotors do not push, without drag."""
    return dataclasses.replace(vacuum, thrust_map=np.array([1e-9, 0.0, -1.0]))


@pytest.fixture(scope="session")
def fly() -> Fly:
    """(physics, plant, state, commands (t, [n,] 4), wind) -> the states after each control step, (t, [n,] ...).

    Flights are filled up to 4 vehicles and a multiple of 300 steps, so that most tests share one program a mode.
    """

    @jax.jit
    def run(physics: Physics, plant: Vehicle, state: State, commands: jax.Array, wind: jax.Array) -> State:
        def one(state: State, command: jax.Array) -> tuple[State, State]:
            state = step(physics, plant, state, command, wind=wind)
            return state, state

        return jax.lax.scan(one, state, commands)[1]

    def filled(physics: Physics, plant: Vehicle, state: State, commands: Any, wind: Any = None) -> State:
        t, n = len(commands), 1 if state.position.ndim == 1 else len(state.position)
        rows, last = np.minimum(np.arange(4), n - 1), -t % 300

        def fill(x: Any, ndim: int) -> jax.Array:
            x = jnp.asarray(x)
            return jnp.broadcast_to(x, (n, *x.shape))[rows] if x.ndim == ndim else x[rows]

        shapes = {f.name: len(f.metadata["shape"]) for f in quantities(plant)}
        plants = {name: fill(getattr(plant, name), ndim) for name, ndim in shapes.items()}
        commands = jnp.broadcast_to(jnp.asarray(commands).reshape(t, -1, 4), (t, n, 4))[:, rows]
        path = run(
            dataclasses.replace(physics, nominal=dataclasses.replace(physics.nominal, name="nominal")),
            Vehicle("plant", **plants),
            jax.tree.map(lambda x: fill(x, 1), state),
            jnp.concatenate([commands, jnp.broadcast_to(commands[-1], (last, 4, 4))]),
            fill(jnp.zeros(3) if wind is None else wind, 1),
        )
        return jax.tree.map(lambda x: x[:t, 0] if state.position.ndim == 1 else x[:t, :n], path)

    return filled


@pytest.fixture(scope="session")
def fly_open_loop() -> Fly:
    """(integrator, plant, state (n, ...), rotor speed commands (t, n, 4), wind, seconds a command, substeps) -> (t, n).

    The numbers of sub-steps and seconds are traced: one program an integrator and batch.
    """

    @partial(jax.jit, static_argnums=0)
    def run(
        integrator: str, plant: Vehicle, state: State, commands: jax.Array, wind: Any, period: Any, substeps: Any
    ) -> State:
        air, dt = Vec3.of(wind), period / substeps
        parts_of_plant = Airframe.of(plant, dt)

        def one(parts: Parts, command: jax.Array) -> tuple[Parts, State]:
            def substep(_: jax.Array, parts: Parts) -> Parts:
                return INTEGRATORS[integrator](parts_of_plant, parts, split(command), air, dt)

            parts = jax.lax.fori_loop(0, substeps, substep, parts)
            return parts, parts.join()

        return jax.lax.scan(one, Parts.of(state), commands)[1]

    return run


@pytest.fixture(scope="session")
def random_state(vis_r: Vehicle) -> Callable[..., State]:
    """(seed, shape) -> states in fast and tumbling flight, in the current default precision."""

    def draw(seed: int, shape: tuple[int, ...] = ()) -> State:
        rng = np.random.default_rng(seed)
        q = rng.normal(size=(*shape, 4))
        return State(
            position=jnp.asarray(rng.normal(size=(*shape, 3))),
            velocity=jnp.asarray(4 * rng.normal(size=(*shape, 3))),
            quaternion=jnp.asarray(q / np.linalg.norm(q, axis=-1, keepdims=True)),
            body_rate=jnp.asarray(2 * rng.normal(size=(*shape, 3))),
            rotor_speed=jnp.asarray(vis_r.hover_rotor_speed * rng.uniform(0.7, 1.3, (*shape, 4))),
        )

    return draw
