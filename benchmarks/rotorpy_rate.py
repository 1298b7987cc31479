"""RotorPy's physics steps/s, run by an interpreter that has it: `python rotorpy_rate.py VEHICLES`.

Its batched multirotor (PyTorch, float64) under collective thrust and body rates, by its fixed-step integrator, 500 Hz.
"""

import sys
import time

import numpy as np
import torch
from rotorpy.vehicles.crazyflie_params import quad_params
from rotorpy.vehicles.multirotor import BatchedMultirotor, BatchedMultirotorParams

STEPS, ROUNDS, PERIOD = 20, 5, 0.002


def rate(vehicles: int) -> float:
    """Physics steps/s of the fastest round."""
    device = torch.device("cpu")
    params = BatchedMultirotorParams([quad_params] * vehicles, vehicles, device)
    zeros = lambda size: torch.zeros(vehicles, size, dtype=torch.float64)  # noqa: E731
    start = {"x": zeros(3), "v": zeros(3), "q": zeros(4), "w": zeros(3), "wind": zeros(3), "rotor_speeds": zeros(4)}
    start["q"][:, 3], start["rotor_speeds"][:] = 1.0, 1788.53
    body = BatchedMultirotor(params, vehicles, start, device, control_abstraction="cmd_ctbr", integrator="rk4")
    rates = torch.from_numpy(0.5 * np.random.default_rng(0).normal(size=(vehicles, 3)))
    command = {"cmd_thrust": torch.full((vehicles, 1), quad_params["mass"] * 9.81 * 1.05).double(), "cmd_w": rates}
    times = []
    with torch.no_grad():
        for _ in range(ROUNDS):
            state, began = dict(start), time.perf_counter()
            for _ in range(STEPS):
                state = body.step(state, command, PERIOD)
            times.append(time.perf_counter() - began)
    if not bool(torch.isfinite(state["x"]).all()):
        raise SystemExit("RotorPy's vehicles left the finite numbers")
    return vehicles * STEPS / min(times[1:])


if __name__ == "__main__":
    print(rate(int(sys.argv[1])))
