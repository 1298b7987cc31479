"""Shares of thrown starts that hit the ground whatever a policy does, by the height of the target.

    python benchmarks/thrown_starts.py [--json FILE]

The bound grants the vehicle free fall, without thrust downwards, while it turns from its start's attitude to a tilt of
60 degrees as fast as it can about both axes; until the loop's latency is over it turns as it was thrown, at the best.
Then all of its thrust is upwards at once. The estimate takes the largest body rate of one axis, and the lags of rotors
and rate loop as dead time besides.
"""

import dataclasses

from common import arguments, table, write

from e2efly.simulation.device import prepare

prepare("cpu")

import numpy as np  # noqa: E402

from e2efly.control.vectors import rotate  # noqa: E402
from e2efly.environment import Env, random_key  # noqa: E402
from e2efly.runs import presets  # noqa: E402
from e2efly.vehicles.gravity import GRAVITY  # noqa: E402
from e2efly.vehicles.loading import load_vehicle  # noqa: E402

STARTS = 100_000


def lost(height: float, bound: bool) -> float:
    """The share of starts about a target at a height, m, that cannot be caught: the bound, or the estimate."""
    config = presets.preset("hover", "ppo", "thrown")
    vehicle, task = load_vehicle(config.env.vehicle), dataclasses.replace(config.task, target=(0.0, 0.0, height))
    state, _ = Env.of(task, config.reward, config.env).task.start(random_key(0), STARTS)
    up = np.asarray(rotate(state.quaternion, np.array([0.0, 0.0, 1.0], np.float32)))[:, 2]
    thrown = np.linalg.norm(np.asarray(state.body_rate)[:, :2], axis=-1)
    delay, rate = float(vehicle.latency), float(vehicle.body_rate_max[0])
    to_turn = np.maximum(0.0, np.arccos(np.clip(up, -1, 1)) - np.pi / 3)
    if bound:
        turned = thrown * delay
        time = np.where(
            to_turn <= turned, to_turn / np.maximum(thrown, 1e-6), delay + (to_turn - turned) / (np.sqrt(2) * rate)
        )
    else:
        time = delay + float(vehicle.motor_time_constant) + 1 / float(vehicle.rate_gain[0]) + to_turn / rate
    z, falling = np.asarray(state.position)[:, 2], np.asarray(state.velocity)[:, 2]
    z, falling = z + falling * time - GRAVITY * time**2 / 2, np.minimum(falling - GRAVITY * time, 0.0)
    most = 4 * float(vehicle.rotor_thrust_max) / float(vehicle.mass) - GRAVITY
    return float(np.mean(z - falling**2 / (2 * most) < float(vehicle.feet_height)))


def main() -> None:
    """Count, print a table, write JSON."""
    options = arguments(__doc__ or "")
    rows = [
        {
            "height of the target, m": f"{height:g}",
            "lost, bound": f"{100 * lost(height, True):.2f} %",
            "lost, estimate": f"{100 * lost(height, False):.2f} %",
        }
        for height in (3.0, 4.0, 5.0)
    ]
    write("thrown_starts", options.json, {"table": rows})
    print(table(rows))


if __name__ == "__main__":
    main()
