"""Open-loop flights against reference trajectories, which independent code integrated with DOP853 to 1e-11."""

import dataclasses
import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from e2efly.control import COMMAND_MODES, command_limits
from e2efly.control.vectors import Vec3
from e2efly.simulation.physics import Physics, State, step
from e2efly.simulation.physics.airframe import Airframe, Rotors
from e2efly.simulation.physics.integrate import INTEGRATORS
from e2efly.simulation.physics.state import Parts
from e2efly.vehicles.loading import load_vehicle, vehicle_names
from e2efly.vehicles.vehicle import Vehicle

pytestmark = pytest.mark.usefixtures("x64")

PERIOD = 1 / 30
FLAT = {"position": (0, 3), "velocity": (3, 6), "quaternion": (6, 10), "body_rate": (10, 13), "rotor_speed": (13, 17)}


@dataclass
class Golden:
    """The cases side by side."""

    model: dict[str, Any]
    plant: Vehicle
    wind: np.ndarray
    commands: np.ndarray
    """(t, n, 4)."""
    states: np.ndarray
    """(t + 1, n, 17)."""

    @property
    def start(self) -> State:
        return State(**{name: jnp.asarray(self.states[0, :, a:b]) for name, (a, b) in FLAT.items()})


@pytest.fixture(scope="module")
def golden() -> Golden:
    data = json.loads((Path(__file__).parents[2] / "data" / "open_loop.json").read_text())
    cases = data["cases"]
    vehicles = [jax.tree.leaves(load_vehicle(case["vehicle"])) for case in cases]
    structure = jax.tree.structure(load_vehicle("vis_r"))
    return Golden(
        model=data,
        plant=jax.tree.unflatten(structure, [np.stack(leaves) for leaves in zip(*vehicles, strict=True)]),
        wind=np.array([case["wind"] for case in cases]),
        commands=np.array([case["rotor_speed_commands"] for case in cases]).swapaxes(0, 1),
        states=np.array([case["states"] for case in cases]).swapaxes(0, 1),
    )


Errors = Callable[[str, int], np.ndarray]


@pytest.fixture
def errors(golden: Golden, fly_open_loop: Callable[..., State]) -> Errors:
    """(integrator, substeps an interval) -> the largest error of each case, over time and entries; rotors in krad/s."""

    def largest(integrator: str, substeps: int) -> np.ndarray:
        path = fly_open_loop(
            integrator, golden.plant, golden.start, jnp.asarray(golden.commands), golden.wind, PERIOD, substeps
        )
        flat = np.concatenate([getattr(path, name) for name in FLAT], axis=-1)
        error = np.abs(flat - golden.states[1:])
        error[..., 13:] /= 1000
        return error.max((0, 2))

    return largest


def test_runge_kutta_converges_to_the_reference(golden: Golden, errors: Errors) -> None:
    assert golden.commands.shape == (60, 6, 4)
    coarse, fine, finest = (errors("rk4", n) for n in (2, 4, 32))
    np.testing.assert_array_less(finest, 1e-7)
    np.testing.assert_array_less(fine, 1e-4)
    assert np.median(np.log2(coarse / fine)) == pytest.approx(4, abs=0.3)


@pytest.mark.parametrize("integrator", ["euler", "semi_implicit"])
def test_first_order_methods_converge_to_the_reference(integrator: str, errors: Errors) -> None:
    coarse, fine, finest = (errors(integrator, n) for n in (50, 100, 200))
    np.testing.assert_allclose(np.log2(coarse / fine), 1, atol=0.1)
    np.testing.assert_allclose(np.log2(fine / finest), 1, atol=0.1)
    np.testing.assert_array_less(np.abs(2 * finest - fine), 0.1 * fine)  # extrapolated to no step: the reference


@pytest.mark.parametrize(("integrator", "order"), [("euler", 1), ("semi_implicit", 1), ("rk3", 3), ("rk4", 4)])
def test_order_of_the_integrator(
    integrator: str, order: int, golden: Golden, random_state: Callable[..., State], fly_open_loop: Callable[..., State]
) -> None:
    """By itself, against its own finer steps; without wind and quadratic drag, whose second derivative jumps."""
    speeds = np.random.default_rng(0).uniform(2000, 2100, (6, 4))
    state = random_state(1, (6,))
    state = dataclasses.replace(state, rotor_speed=jnp.asarray(speeds))
    plant = dataclasses.replace(golden.plant, drag_quadratic=np.zeros((6, 3)))
    commands = jnp.broadcast_to(speeds + 200, (60, 6, 4))

    def end(name: str, substeps: int) -> np.ndarray:
        path = fly_open_loop(name, plant, state, commands, 0 * golden.wind, 0.005, substeps)
        return np.concatenate(
            [getattr(path, name)[-1] for name in ("position", "velocity", "quaternion", "body_rate")], -1
        )

    exact = end("rk4", 24)
    coarse, fine = (np.abs(end(integrator, n) - exact).max() for n in (1, 2))
    assert np.log2(coarse / fine) == pytest.approx(order, abs=0.15)


@pytest.mark.whole(but=1)
@pytest.mark.parametrize("name", vehicle_names())
def test_the_default_physics_is_exact_to_a_millimetre_over_two_seconds(name: str) -> None:
    """As a policy flies it: float32, its sub-steps; against the same commands and rate loop, integrated finely."""
    vehicle, rng, flights = load_vehicle(name), np.random.default_rng(0), 20
    steps = round(2 * vehicle.control_rate)
    asked = rng.uniform([4, -4, -4, -4], [16, 4, 4, 4], (steps // 6 + 1, flights, 4))
    commands = np.clip(asked.repeat(6, 0)[:steps], *command_limits(COMMAND_MODES["ctbr"], vehicle))
    quaternion = rng.normal([3, 0, 0, 0], 1, (flights, 4))
    start = dataclasses.replace(
        State.hovering(vehicle, np.zeros((flights, 3))),
        velocity=jnp.asarray(rng.uniform(-3, 3, (flights, 3))),
        quaternion=jnp.asarray(quaternion / np.linalg.norm(quaternion, axis=1, keepdims=True)),
    )

    def end(dtype: type, **integrator: str) -> np.ndarray:
        physics = Physics.of(vehicle, dtype=dtype, **integrator)

        def flight(start: State, commands: jax.Array) -> State:
            return jax.lax.scan(lambda s, c: (step(physics, physics.nominal, s, c), None), start, commands)[0]

        first, asked = jax.tree.map(lambda x: jnp.asarray(x, dtype), (start, commands))
        return np.asarray(jax.jit(flight)(first, asked).position, np.float64)

    def fine(plant: Airframe, parts: Parts, command: Rotors, wind: Vec3 | None, dt: float) -> Parts:
        count = 16
        finer = dataclasses.replace(plant, decay=plant.decay ** (1 / count), half_decay=plant.half_decay ** (1 / count))
        return jax.lax.fori_loop(0, count, lambda _, p: INTEGRATORS["rk4"](finer, p, command, wind, dt / count), parts)

    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(INTEGRATORS, "fine", fine)
        exact = end(np.float64, integrator="fine")
    error = np.linalg.norm(end(np.float32) - exact, axis=1)
    assert error.max() < 1e-3
