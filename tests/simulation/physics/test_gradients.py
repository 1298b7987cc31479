"""Exact gradients of a control step against central differences, in every command mode, and where they could break."""

import dataclasses
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.flatten_util import ravel_pytree

from e2efly.control import COMMAND_MODES
from e2efly.simulation.physics import INTEGRATORS, Physics, State, rotation, step
from e2efly.vehicles.vehicle import Vehicle
from tests.gradients import central, reverse
from tests.simulation.physics.test_flight import COMMANDS

pytestmark = pytest.mark.usefixtures("x64")

SHAPES = {
    "mass": (),
    "inertia": (3,),
    "rotor_position": (4, 2),
    "thrust_map": (3,),
    "torque_ratio": (),
    "motor_time_constant": (),
    "drag_linear": (3,),
    "drag_quadratic": (3,),
}
"""The vehicle's parameters that move the plant."""
KRAD = 1000.0
HOVER = {
    "rotor_thrust": [0.75 * 9.81 / 4] * 4, "rotor_share": [0.75 * 9.81 / 4 / 5.12] * 4, "rotor_speed": [0.6] * 4,
    "ctbr": [9.81, 0, 0, 0], "attitude": [9.81, 0, 0, 0],
}  # fmt: skip
EXTREME = {
    "rotor_thrust": [9.0, -1.0, 9.0, 8.0],
    "rotor_share": [1.8, -0.2, 1.8, 1.6],
    "rotor_speed": [1.4, -0.2, 1.3, 1.2],
    "ctbr": [80.0, 9.0, -20.0, 3.0],
    "attitude": [70.0, 1.5, -1.5, 2.0],
    "acceleration": [50.0, -60.0, 40.0, 0.6],
    "velocity": [30.0, 20.0, 25.0, -0.4],
    "position": [40.0, 50.0, -60.0, 0.3],
}


def inputs(mode: str, q: Any, command: list[float], speed: float = 1.0, switch: float = 0.3) -> dict[str, Any]:
    """Everything that a step depends on, each of order one: rotors in krad/s, vehicle parameters over their own."""
    rest = speed == 0.0
    return {
        "position": jnp.asarray([0.1, -0.2, 0.3]) * speed,
        "velocity": jnp.asarray([0.5, -0.3, 0.2]) * speed,
        "quaternion": jnp.asarray(q, float),
        "body_rate": jnp.asarray([0.3, -0.5, 0.2]) * speed,
        "rotor_speed": jnp.asarray([2.117] * 4 if rest else [2.0, 2.1, 2.2, 2.05]),
        "command": jnp.asarray(command),
        "previous": jnp.asarray(command) + (0.0 if rest else jnp.asarray([0.2, -0.1, 0.15, -0.1])),
        "switch": jnp.asarray(switch),
        "wind": jnp.asarray([0.4, -0.6, 0.2]) * speed,
        "plant": {name: jnp.ones(shape) for name, shape in SHAPES.items()},
        "share": jnp.asarray([1.0, 0.9, 0.95, 1.05]),
    }


def flat(points: list[dict[str, Any]]) -> jax.Array:
    """(points, entries)."""
    return jnp.stack([ravel_pytree(p)[0] for p in points])


def names(point: dict[str, Any]) -> list[str]:
    """What each entry of the flat vector is."""
    leaves = jax.tree_util.tree_leaves_with_path(point)
    return [f"{path[-1].key}[{i}]" for path, leaf in leaves for i in range(leaf.size)]


def stepper(vehicle: Vehicle, mode: str, integrator: str = "semi_implicit") -> Callable[[jax.Array], jax.Array]:
    """Two sub-steps as a function of flat rows."""
    physics = Physics.of(vehicle, mode, integrator, control_rate=100.0, dtype=np.float64)
    assert physics.substeps == 2
    structure = ravel_pytree(inputs(mode, GENERIC, COMMANDS[mode]))[1]

    def run(x: jax.Array) -> jax.Array:
        i = jax.vmap(structure)(x)
        plant = dataclasses.replace(vehicle, **{name: getattr(vehicle, name) * i["plant"][name] for name in SHAPES})
        state = State(i["position"], i["velocity"], i["quaternion"], i["body_rate"], KRAD * i["rotor_speed"])
        end = step(
            physics, plant, state, i["command"],
            previous=i["previous"], switch_time=i["switch"] * physics.control_period, wind=i["wind"],
            rotor_share=i["share"],
        )  # fmt: skip
        return jnp.concatenate([end.position, end.velocity, end.quaternion, end.body_rate, end.rotor_speed / KRAD], -1)

    return run


GENERIC = rotation.from_euler(*map(np.asarray, (0.2, -0.1, 0.4)))


def smooth(mode: str) -> dict[str, dict[str, Any]]:
    """Points about which the step is smooth."""
    return {
        "generic": inputs(mode, GENERIC, COMMANDS[mode]),
        "late switch": inputs(mode, GENERIC, COMMANDS[mode], switch=0.8),
        "tumbling": inputs(mode, [0.5, -0.5, 0.6, np.sqrt(0.14)], COMMANDS[mode], speed=5.0),
        "saturated": inputs(mode, GENERIC, EXTREME[mode]),
        "level and still": inputs(mode, [1, 0, 0, 0], HOVER.get(mode, [0.0] * 4), speed=0.0),
    }


def corners(mode: str) -> list[dict[str, Any]]:
    """Half turns, zero speed, standing rotors, limits, the switch at either end."""
    hover, half_turns, level = HOVER.get(mode, [0.0] * 4), np.eye(4)[1:], [1, 0, 0, 0]
    points = [inputs(mode, q, hover, speed=v, switch=s) for q in half_turns for v, s in ((0.0, 0.0), (1.0, 0.5))]
    points.append(inputs(mode, level, hover, speed=0.0, switch=1.0))
    points.append(inputs(mode, level, EXTREME[mode], speed=0.0, switch=0.0))
    points.append(inputs(mode, level, (-np.asarray(EXTREME[mode])).tolist(), speed=0.0))
    points.append({**points[0], "rotor_speed": jnp.zeros(4)})
    return points


@pytest.mark.whole(but=1)
@pytest.mark.parametrize(
    ("mode", "integrator"),
    [(mode, "semi_implicit") for mode in COMMAND_MODES]
    + [("ctbr", name) for name in INTEGRATORS if name != "semi_implicit"],
)
def test_gradients_of_a_step(mode: str, integrator: str, vis_r: Vehicle) -> None:
    """With respect to state, both commands, the switch, wind and plant: exact where smooth, finite everywhere."""
    points, run = smooth(mode), stepper(vis_r, mode, integrator)
    rows = flat(list(points.values()))
    with jax.disable_jit():  # compiled gradients: see below
        exact = np.asarray(reverse(run, jnp.concatenate([rows, flat(corners(mode))]), 17))
        numeric = np.asarray(central(run, rows))
    assert np.all(np.isfinite(exact))
    entries = names(points["generic"])
    for i, point in enumerate(points):
        wrong = np.argwhere(np.abs(exact[i] - numeric[i]) > 1e-6 * (1 + np.abs(numeric[i])))
        assert not len(wrong), [(point, int(o), entries[p], exact[i, o, p], numeric[i, o, p]) for o, p in wrong[:5]]
    for name in ("velocity", "command", "previous", "switch", "wind", "mass", "thrust_map", "drag_linear", "share"):
        column = [i for i, entry in enumerate(entries) if entry.startswith(name)]
        assert np.max(np.abs(exact[0][:, column])) > 1e-8, name  # each of them matters


def test_compiled_gradients_are_the_same(vis_r: Vehicle) -> None:
    run, points = stepper(vis_r, "rotor_thrust"), flat([*smooth("rotor_thrust").values(), *corners("rotor_thrust")])
    with jax.disable_jit():
        plain = reverse(run, points, 17)
    compiled = jax.jit(lambda x: reverse(run, x, 17))(points)
    np.testing.assert_allclose(compiled, plain, rtol=1e-9, atol=1e-9)


def test_single_precision_gradients_are_finite_at_hover(vis_r: Vehicle) -> None:
    """Of the whole cascade, where its errors are zero."""
    with jax.enable_x64(False):
        physics = Physics.of(vis_r, "position", control_rate=200.0)

        def loss(state: State, command: jax.Array) -> jax.Array:
            end = step(physics, physics.nominal, state, command)
            return jnp.sum(end.position) + jnp.sum(end.quaternion) + jnp.sum(end.rotor_speed)

        gradient = jax.jit(jax.grad(loss, (0, 1)))(State.hovering(vis_r, jnp.zeros(3)), jnp.zeros(4))
        assert all(leaf.dtype == jnp.float32 for leaf in jax.tree.leaves(gradient))
        assert all(np.all(np.isfinite(leaf)) for leaf in jax.tree.leaves(gradient))
