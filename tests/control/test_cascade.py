"""The controllers that fly are the controllers of the simulator."""

import jax.numpy as jnp
import numpy as np
import pytest

from e2efly.control import COMMAND_MODES, Quat, Vec3, command_limits
from e2efly.simulation.physics import Physics, State
from e2efly.simulation.physics.control import control_law
from e2efly.simulation.physics.state import Parts
from e2efly.vehicles.loading import load_vehicle

VEHICLE = load_vehicle("vis_r")
RNG = np.random.default_rng(3)


class _Motion:
    """What the bridge knows, in NumPy's float64 scalars."""

    def __init__(self, row: np.ndarray) -> None:
        self.position, self.velocity = Vec3(*row[:3]), Vec3(*row[3:6])
        self.attitude = Quat(*row[6:10])


def _states(n: int) -> np.ndarray:
    q = RNG.normal(size=(n, 4))
    return np.hstack([RNG.normal(size=(n, 3)) * 3, RNG.normal(size=(n, 3)) * 4, q / np.linalg.norm(q, axis=1)[:, None]])


@pytest.mark.parametrize("mode", [name for name, mode in COMMAND_MODES.items() if mode.controller])
def test_numpy_equals_the_simulators_law(mode: str) -> None:
    rows = _states(200)
    low, high = command_limits(COMMAND_MODES[mode], VEHICLE)
    commands = low + (high - low) * RNG.uniform(-0.2, 1.2, (200, 4))
    physics = Physics.of(VEHICLE, mode, dtype=np.float64)
    rates = RNG.normal(size=(200, 3))
    state = State(*(jnp.asarray(x) for x in (rows[:, :3], rows[:, 3:6], rows[:, 6:], rates, np.zeros((200, 4)))))
    parts = Parts.of(state)
    law = control_law(COMMAND_MODES[mode])
    simulated = np.stack(law(physics.nominal, physics.mixer, parts, tuple(jnp.asarray(commands).T)), axis=-1)
    # what the bridge sends, given to the simulator's CTBR mode, asks the rotors for the same
    flown = np.array([_ctbr(mode, row, command) for row, command in zip(rows, commands, strict=True)])
    same = control_law(COMMAND_MODES["ctbr"])(physics.nominal, physics.mixer, parts, tuple(jnp.asarray(flown).T))
    np.testing.assert_allclose(np.stack(same, axis=-1), simulated, rtol=2e-4, atol=2e-2)  # rad/s, of 4000; float32


def _ctbr(mode: str, row: np.ndarray, command: np.ndarray) -> np.ndarray:
    controller = COMMAND_MODES[mode].controller
    assert controller is not None
    out = controller(VEHICLE, _Motion(row), tuple(command))
    return np.array([out.thrust, out.rate.x, out.rate.y, out.rate.z])


def test_body_rates_stay_within_the_vehicles() -> None:
    for row in _states(100):
        out = _ctbr("position", row, np.array([50.0, -50.0, 50.0, 3.0]))
        assert (np.abs(out[1:]) <= VEHICLE.body_rate_max + 1e-9).all()
        assert out[0] >= 0
