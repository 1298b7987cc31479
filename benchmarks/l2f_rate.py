"""L2F's physics steps/s, run by an interpreter that has it: `python l2f_rate.py VEHICLES`.

One call steps all vehicles, on all cores (OpenMP): one step of RK4, 10 ms, under rotor commands.
"""

import sys
import time

import l2f
import numpy as np

STEPS, ROUNDS = 200, 5


def rate(vehicles: int) -> float:
    """Physics steps/s of the fastest round."""
    vector = l2f.vector_selector[vehicles]
    device, rng, env = l2f.Device(), vector.VectorRng(), vector.VectorEnvironment()
    parameters, state, following = vector.VectorParameters(), vector.VectorState(), vector.VectorState()
    vector.initialize_rng(device, rng, 0)
    vector.initialize_environment(device, env)
    vector.sample_initial_parameters(device, env, parameters, rng)
    action = np.random.default_rng(0).uniform(-0.5, 0.5, (vehicles, 4)).astype(np.float32)
    times = []
    for _ in range(ROUNDS):
        vector.sample_initial_state(device, env, parameters, state, rng)
        began = time.perf_counter()
        for _ in range(STEPS):
            vector.step(device, env, parameters, state, action, following, rng)
            state, following = following, state
        times.append(time.perf_counter() - began)
    if not all(np.isfinite(s.position).all() for s in state.states):
        raise SystemExit("L2F's vehicles left the finite numbers")
    return vehicles * STEPS / min(times[1:])


if __name__ == "__main__":
    print(rate(int(sys.argv[1])))
