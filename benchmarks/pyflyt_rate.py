"""PyFlyt's physics steps/s, run by an interpreter that has it: `python pyflyt_rate.py VEHICLES`.

Quadrotors in one Bullet world, 10 m apart, under body rates and thrust, 240 Hz; 64 of them at most, as more do not
make a step of one cheaper.
"""

import sys
import time

import numpy as np
from PyFlyt.core import Aviary

MOST, STEPS, ROUNDS = 64, 50, 4


def rate(vehicles: int) -> float:
    """Physics steps/s of the fastest round."""
    side = int(np.ceil(np.sqrt(vehicles)))
    places = np.array([(10.0 * (i % side), 10.0 * (i // side), 100.0) for i in range(vehicles)])
    world = Aviary(start_pos=places, start_orn=np.zeros((vehicles, 3)), drone_type="quadx", physics_hz=240)
    world.set_mode(0)
    world.set_all_setpoints(np.tile([0.5, -0.3, 0.2, 0.5], (vehicles, 1)))
    times = []
    for _ in range(ROUNDS):
        began, before = time.perf_counter(), world.physics_steps
        for _ in range(STEPS):
            world.step()
        times.append((time.perf_counter() - began) / (world.physics_steps - before))
    return vehicles / min(times[1:])


if __name__ == "__main__":
    print(rate(min(MOST, int(sys.argv[1]))))
