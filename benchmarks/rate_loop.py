"""What a held rate loop costs: positions of the training's physics beside those of an independent plant.

    python benchmarks/rate_loop.py [--vehicle vis_r] [--flights 100] [--json FILE]

The plant is `examples/09_own_physics.py`, in NumPy and float64, which shares no code with the training's physics. It is
integrated by RK4 in steps of at most 0.25 ms. Its rate loop runs once in a step of the training, or at 1 or 4 kHz,
and its rotor commands hold in between. Each flight begins at hover and has 2 s of violent `ctbr` commands: every 0.2 s
another collective thrust, 0.3 to 1.8 g, and body rates anywhere within the vehicle's limits. There is no delay.
"""

import importlib.util
import math
from pathlib import Path
from typing import Any

import jax
import numpy as np
from common import arguments, table, write

from e2efly.simulation.device import prepare
from e2efly.simulation.physics import Physics, State, step
from e2efly.vehicles.loading import load_vehicle

FLIGHT_S, HELD_S, FINE_S = 2.0, 0.2, 0.00025
"""Duration of a flight, of a command, and of a step of the independent plant, s."""
EXAMPLE = Path(__file__).parents[1] / "examples" / "09_own_physics.py"


def independent() -> Any:
    """The module of the independent plant."""
    spec = importlib.util.spec_from_file_location("own_physics", EXAMPLE)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def held(plant: Any, m: Any, command: np.ndarray, period: float) -> Any:
    """The motion after a period of the rate loop, whose rotor commands hold: RK4, with the rotors' exact speeds."""
    goal, count = plant.wanted(m, command), math.ceil(period / FINE_S - 1e-9)
    dt = period / count
    left = np.exp(-dt / 2 / plant.v.motor_time_constant)
    for _ in range(count):
        middle = goal + (m.rotor_speed - goal) * left
        end = goal + (middle - goal) * left
        a = plant.rate(m, m.rotor_speed)
        b = plant.rate(m.plus(a, dt / 2), middle)
        c = plant.rate(m.plus(b, dt / 2), middle)
        d = plant.rate(m.plus(c, dt), end)
        m = m.plus(a, dt / 6).plus(b, dt / 3).plus(c, dt / 3).plus(d, dt / 6)
        unit = m.quaternion / np.linalg.norm(m.quaternion, axis=-1, keepdims=True)
        m = type(m)(m.position, m.velocity, unit, m.body_rate, end)
    return m


def sequences(vehicle: Any, flights: int) -> np.ndarray:
    """Commands by time: (commands, flights, 4)."""
    rng, count = np.random.default_rng(0), round(FLIGHT_S / HELD_S)
    thrust = 9.81 * rng.uniform(0.3, 1.8, (count, flights, 1))
    return np.concatenate([thrust, rng.uniform(-1, 1, (count, flights, 3)) * vehicle.body_rate_max], axis=-1)


def flown(vehicle: Any, commands: np.ndarray, loop_hz: float) -> np.ndarray:
    """Positions at the end in the independent plant, (flights, 3) m."""
    module = independent()
    plant, n = module.Physics(vehicle), commands.shape[1]
    still = np.zeros((n, 3))
    m = module.Motion(still, still, np.tile([1.0, 0, 0, 0], (n, 1)), still, np.full((n, 4), plant.hover))
    for tick in range(round(FLIGHT_S * loop_hz)):
        m = held(plant, m, commands[int(tick / loop_hz / HELD_S + 1e-9)], 1 / loop_hz)
    return m.position


def trained(vehicle: Any, commands: np.ndarray) -> tuple[np.ndarray, float]:
    """Positions at the end in the training's physics, (flights, 3) m, and the rate of its steps, Hz."""
    physics, n = Physics.of(vehicle), commands.shape[1]
    hover, still = np.full((n, 4), vehicle.hover_rotor_speed, np.float32), np.zeros((n, 3), np.float32)
    state = State(still, still, np.tile(np.float32([1, 0, 0, 0]), (n, 1)), still, hover)
    advance = jax.jit(step)
    for i in range(round(FLIGHT_S / physics.control_period)):
        command = commands[int(i * physics.control_period / HELD_S + 1e-9)].astype(np.float32)
        state = advance(physics, physics.nominal, state, command)
    return np.asarray(state.position, np.float64), physics.substeps / physics.control_period


def main() -> None:
    """Measure, print a table, write JSON."""
    options = arguments(__doc__ or "", vehicle="vis_r", flights=100)
    prepare("cpu")
    vehicle = load_vehicle(options.vehicle)
    commands = sequences(vehicle, options.flights)
    ours, ticks = trained(vehicle, commands)
    rows = []
    for name, hz in (
        (f"held for {1e3 / ticks:.2f} ms, a training step", ticks),
        ("1 kHz", 1000.0),
        ("4 kHz", 4000.0),
    ):
        off = 1e3 * np.linalg.norm(ours - flown(vehicle, commands, hz), axis=-1)
        figures = {"mean": off.mean(), "median": np.median(off), "largest": off.max()}
        rows.append({"rate loop of the plant": name} | {f"{k}, mm": f"{v:.3g}" for k, v in figures.items()})
    write("rate_loop", options.json, {"table": rows, "vehicle": options.vehicle, "flights": options.flights})
    print(table(rows))


if __name__ == "__main__":
    main()
