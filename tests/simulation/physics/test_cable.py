"""A load on a cable: conservation, the period of its swing, its stretch, stability at every step, gradients."""

import dataclasses
import math
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.flatten_util import ravel_pytree

from e2efly.control.vectors import rotate
from e2efly.simulation.physics import INTEGRATORS, Load, Physics, State, step
from e2efly.simulation.physics.airframe import Airframe
from e2efly.simulation.physics.cable import RESOLVED, hung
from e2efly.simulation.physics.integrate import SWINGING
from e2efly.simulation.physics.state import Parts, split
from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.vehicle import Vehicle
from tests.gradients import central, reverse

pytestmark = pytest.mark.usefixtures("x64")

STEP = 0.005
"""The largest sub-step of the environment, s."""


def carrying(state: State, angle: Any, mass: Any, length: Any, hook: Any = 0.0) -> State:
    """The state with a load whose cable is at an angle from the vertical, rad, towards world x."""
    angle, mass, length, hook = jnp.broadcast_arrays(*(jnp.asarray(x, float) for x in (angle, mass, length, hook)))
    down = jnp.stack([jnp.sin(angle), 0 * angle, -jnp.cos(angle)], axis=-1)
    load = hung(state.position, state.velocity, state.quaternion, down, mass, length, hook)
    return dataclasses.replace(state, load=load)


def sailed(vehicle: Vehicle, start: State, seconds: float, dt: float = STEP, integrator: str = "rk4") -> State:
    """The states (t, ...) at constant rotor speeds, after each sub-step."""
    plant, speed = Airframe.of(vehicle, dt, load=start.load), split(start.rotor_speed)

    def one(parts: Parts, _: None) -> tuple[Parts, State]:
        parts = INTEGRATORS[integrator](plant, parts, speed, None, dt)
        return parts, parts.join(start.load)

    return jax.jit(lambda s: jax.lax.scan(one, Parts.of(s), None, round(seconds / dt))[1])(start)


def lifting(vehicle: Vehicle, mass: float) -> State:
    """Level and still, with rotors that carry vehicle and load."""
    loaded = dataclasses.replace(vehicle, mass=vehicle.mass + mass)
    return State.hovering(loaded, jnp.array([0.0, 0.0, 3.0]))


def test_a_whirling_load_keeps_the_momenta_of_the_pair(stone: Vehicle, random_state: Callable[..., State]) -> None:
    """Vehicle and load fall together, turn about each other, and lose energy to the cable alone."""
    start = random_state(3)
    mass, hook = 0.3, 0.04
    start = carrying(start, 0.7, mass, 0.5, hook)
    assert start.load is not None
    load = dataclasses.replace(start.load, velocity=start.velocity + jnp.array([2.0, 3.0, 1.0]))
    path = sailed(stone, dataclasses.replace(start, load=load), 1.0, dt=2e-4)
    assert path.load is not None
    total = stone.mass + mass
    momentum = stone.mass * path.velocity + mass * path.load.velocity
    time = 2e-4 * (1 + np.arange(len(momentum)))
    first = stone.mass * start.velocity + mass * load.velocity
    expected = first - time[:, None] * jnp.array([0.0, 0.0, GRAVITY * total])
    np.testing.assert_allclose(momentum, expected, atol=1e-6)

    def spin(s: State, load: Load) -> jax.Array:
        own = rotate(s.quaternion, s.body_rate * stone.inertia)
        reduced = stone.mass * mass / total
        return own + reduced * jnp.cross(load.position - s.position, load.velocity - s.velocity)

    moments = spin(path, path.load)
    np.testing.assert_allclose(moments, jnp.broadcast_to(spin(start, load), moments.shape), atol=1e-6)
    hooked = path.position + rotate(path.quaternion, jnp.broadcast_to(jnp.array([0.0, 0.0, -hook]), momentum.shape))
    stretch = jnp.linalg.norm(path.load.position - hooked, axis=-1) - 0.5
    cable = Airframe.of(stone, 2e-4, load=load).cable
    assert cable is not None
    energy = (
        stone.mass * (path.velocity**2).sum(-1) / 2 + mass * (path.load.velocity**2).sum(-1) / 2
        + (stone.inertia * path.body_rate**2).sum(-1) / 2 + cable.stiffness * jnp.maximum(stretch, 0) ** 2 / 2
        + GRAVITY * (stone.mass * path.position[:, 2] + mass * path.load.position[:, 2])
    )  # fmt: skip
    assert jnp.max(jnp.diff(energy)) < 1e-6
    assert float(energy[0] - energy[-1]) > 0.005  # the jerk with which the cable became taut


def test_a_slack_cable_does_nothing(vis_r: Vehicle) -> None:
    """A load nearer than the cable is long falls freely, and the vehicle flies as without it."""
    start = State.hovering(vis_r, jnp.array([0.0, 0.0, 3.0]))
    slack = carrying(start, 0.4, 0.3, 2.0)
    assert slack.load is not None
    near = dataclasses.replace(slack.load, position=start.position + jnp.array([0.1, 0.0, -0.1]))
    path = sailed(vis_r, dataclasses.replace(slack, load=near), 0.5)
    alone = sailed(vis_r, start, 0.5)
    assert path.load is not None
    np.testing.assert_allclose(path.position, alone.position, atol=1e-12)
    np.testing.assert_allclose(path.load.position[-1, 2], 2.9 - GRAVITY * 0.5**2 / 2, atol=1e-9)


@pytest.mark.parametrize("integrator", SWINGING)
@pytest.mark.parametrize(("mass", "length"), [(0.075, 0.3), (0.375, 1.0)])
def test_a_free_vehicle_swings_with_its_load(vacuum: Vehicle, integrator: str, mass: float, length: float) -> None:
    """A load under a vehicle that is free to move: the angular frequency is sqrt(g (M + m) / (M L)), for small angles.

    So it is at the environment's own sub-step, and the amplitude stays.
    """
    start = carrying(lifting(vacuum, mass), math.radians(2), mass, length)
    period = 2 * math.pi * math.sqrt(length / GRAVITY * vacuum.mass / (vacuum.mass + mass))
    path = sailed(vacuum, start, 6 * period, integrator=integrator)
    assert path.load is not None
    aside = np.asarray(path.load.position - path.position)[:, 0]
    time = STEP * (1 + np.arange(len(aside)))
    at = np.flatnonzero((aside[:-1] < 0) & (aside[1:] >= 0))
    crossings = time[at] - STEP * aside[at] / (aside[at + 1] - aside[at])
    np.testing.assert_allclose(np.diff(crossings), period, rtol=0.005)
    np.testing.assert_allclose(np.abs(aside[-round(period / STEP) :]).max(), abs(start.load.position[0]), rtol=0.08)


def test_the_stretch_is_as_said(vacuum: Vehicle) -> None:
    """In hover, and a quarter of it with half of the sub-step."""
    for dt in (STEP, STEP / 2):
        path = sailed(vacuum, carrying(lifting(vacuum, 0.375), 0.0, 0.375, 0.5), 2.0, dt)
        assert path.load is not None
        stretch = float(path.position[-1, 2] - path.load.position[-1, 2]) - 0.5
        assert stretch == pytest.approx(1.5 * GRAVITY * (RESOLVED * dt / (2 * math.pi)) ** 2, rel=1e-3)
    assert 1e-4 < stretch < 3e-4


@pytest.mark.parametrize("integrator", SWINGING)
def test_no_load_breaks_the_step(vis_r: Vehicle, integrator: str) -> None:
    """Feathers and anvils, short and long cables, at the centre of mass and below it, jerked about at the environment's
    own sub-step: no cable becomes more than a quarter longer, however hard the jerk.
    """
    physics = Physics.of(vis_r, "velocity", integrator, dtype=np.float64)
    mass, length, hook = (x.ravel() for x in np.meshgrid([0.0075, 0.1, 0.75], [0.1, 1.0], [0.0, 0.05]))
    start = State.hovering(physics.nominal, jnp.zeros((len(mass), 3)).at[:, 2].set(3.0))
    start = carrying(start, 0.6, mass, length, hook)
    jerks = np.random.default_rng(0).uniform(-3, 3, (9, 3)).repeat(10, 0)
    commands = jnp.concatenate([jnp.asarray(jerks), jnp.zeros((90, 1))], axis=1)

    def one(state: State, command: jax.Array) -> tuple[State, jax.Array]:
        state = step(physics, physics.nominal, state, jnp.broadcast_to(command, (len(mass), 4)))
        assert state.load is not None
        hooked = state.position + rotate(state.quaternion, jnp.stack([0 * hook, 0 * hook, -hook], axis=-1))
        return state, jnp.linalg.norm(state.load.position - hooked, axis=-1) / length

    distance = jax.jit(lambda s: jax.lax.scan(one, s, commands)[1])(start)
    assert float(distance.max()) < 1.25  # false for NaN


@pytest.mark.parametrize(
    ("integrator", "beyond"),
    [("semi_implicit", 0.002), ("semi_implicit", -0.05), pytest.param("rk3", 0.002, marks=pytest.mark.whole)],
)
def test_gradients_through_the_cable(vis_r: Vehicle, integrator: str, beyond: float) -> None:
    """Exact gradients of a control step agree with central differences, with respect to everything about the load."""
    physics = Physics.of(vis_r, "ctbr", integrator, control_rate=100.0, dtype=np.float64)
    start = carrying(State.hovering(physics.nominal, jnp.array([0.1, -0.2, 3.0])), 0.3, 0.2, 0.5, 0.03)
    assert start.load is not None
    inputs = {
        "load": dataclasses.replace(start.load, length=start.load.length - beyond, velocity=jnp.array([0.2, 0.1, 0.1])),
        "position": start.position,
        "velocity": jnp.array([0.1, 0.2, -0.1]),
        "body_rate": jnp.array([0.3, -0.2, 0.1]),
    }
    row, back = ravel_pytree(inputs)

    def one(row: jax.Array) -> jax.Array:
        state = dataclasses.replace(start, **back(row))
        return ravel_pytree(step(physics, physics.nominal, state, jnp.array([11.0, 0.5, -0.3, 0.2])))[0]

    f = jax.jit(jax.vmap(one))
    expected = central(f, row[None])
    np.testing.assert_allclose(reverse(f, row[None], expected.shape[1]), expected, rtol=1e-5, atol=2e-6)
    moved = np.abs(expected[0, :3, :]).max(0)  # what moves the vehicle
    names = [str(path[-1]) for path, leaf in jax.tree_util.tree_leaves_with_path(inputs) for _ in range(leaf.size)]
    of_load = [m for name, m in zip(names, moved, strict=True) if name in (".mass", ".length", ".hook")]
    assert all(m > 1e-6 for m in of_load) if beyond > 0 else not any(of_load)


def test_explicit_euler_is_refused(vis_r: Vehicle) -> None:
    """It adds energy to a swing."""
    physics = Physics.of(vis_r, integrator="euler")
    state = carrying(State.hovering(physics.nominal, jnp.zeros(3)), 0.3, 0.2, 0.5)
    with pytest.raises(ValueError, match=r"integrator is 'euler'; accepted with a load: semi_implicit, rk3, rk4"):
        step(physics, physics.nominal, state, jnp.array([9.81, 0, 0, 0]))


def test_no_load_adds_nothing(vis_r: Vehicle) -> None:
    """A state without a load has the leaves that it had, and no cable is computed."""
    assert len(jax.tree.leaves(State.hovering(vis_r, jnp.zeros(3)))) == 5
    assert Airframe.of(vis_r, STEP).cable is None
