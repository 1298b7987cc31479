"""Hover of 1000 unseen vehicles by one policy: ours and RAPTOR, in the same run, plant and starts, by delay.

    python benchmarks/raptor.py [--rotors POLICY] [--form POLICY] [--ctbr POLICY] [--vehicles 1000]

RAPTOR (J. Eschmann et al., RAPTOR: A Foundation Policy for Quadrotor Control, 2025) is the checkpoint of
`foundation-policy` 1.0.2 of PyPI, which is installed on first use into an environment of its own in the user's cache
folder. It flies as `e2efly export checkpoint.h5` makes a policy of it: a hundred questions a second, position errors
and velocities clipped as PX4 clips them, commands that are shares of the rotors' full speed. Ours in the same form is
of the preset `raptor` of hover, trained here unless `--form` names its run. Ours by rotors, and by collective thrust
and body rates, are the zoo's unless others are named.

Vehicles are drawn by `e2efly.vehicles.family` with seed 7; "of RAPTOR's kind" are those within the ranges that it was
trained on, as far as mass, thrust and roll say it. Starts: those of hover, heading along x, and starts within 0.5 m of
the target, level and at rest. Success: within 0.1 m for the last second of 8 s.
"""

import dataclasses
import subprocess
import sys
import tempfile
from functools import partial
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from common import arguments, table, write
from peers import packages

from e2efly.config import EnvConfig, RewardConfig
from e2efly.environment import UNSEEN, Env, EnvState, random_key
from e2efly.environment.episodes import Act, Episodes, run_stepwise
from e2efly.learning.raptor_import import import_checkpoint
from e2efly.simulation.device import prepare
from e2efly.simulation.physics.body import hover_rotor_speed
from e2efly.simulation.physics.rotation import from_euler, multiply, yaw
from e2efly.tasks.hover import HoverConfig
from e2efly.validation.candidate import candidate
from e2efly.validation.evaluation import act_of
from e2efly.vehicles.family import DRAWN, load_family
from e2efly.vehicles.gravity import GRAVITY

NEEDS = "foundation-policy==1.0.2", "numpy"
SEED, BATCH = 7, 250
ROTORS, RATES = (0.0, 0.01, 0.02, 0.03), (0.0, 0.03, 0.06, 0.09, 0.12)
"""Delays, s."""
NEAR = HoverConfig(position=0.5, velocity=0.0, tilt=0.0, body_rate=0.0)


def raptor(folder: Path) -> Path:
    """RAPTOR's published checkpoint as a policy of ours."""
    published, path = packages(*NEEDS) / "foundation_policy" / "blob" / "checkpoint.h5", folder / "raptor.onnx"
    sys.path.append(str(packages(*NEEDS)))  # of h5py
    import_checkpoint(published, path)
    return path


def fly(env: Env, act: Act, drawn: np.ndarray) -> Episodes:
    """An episode of each vehicle."""

    def altered(u: Any, state: EnvState) -> EnvState:
        assert env.family is not None
        speed = jnp.broadcast_to(hover_rotor_speed(env.family.draw(u))[:, None], (BATCH, 4))
        begun = state.vehicle
        zero = jnp.zeros(BATCH)
        level = multiply(from_euler(zero, zero, -yaw(begun.quaternion)), begun.quaternion)
        return dataclasses.replace(
            state, family=u, vehicle=dataclasses.replace(begun, rotor_speed=speed, quaternion=level)
        )

    parts = []
    for i in range(0, len(drawn), BATCH):
        u = drawn[i : i + BATCH].astype(np.float32)
        key, steps = random_key(SEED, UNSEEN, i), env.episode_steps
        parts.append(run_stepwise(env, act, key, BATCH, steps, altered=partial(altered, u))[0])
    return jax.tree.map(lambda *x: np.concatenate(x), *parts)


def alike(drawn: np.ndarray) -> np.ndarray:
    """Which vehicles RAPTOR was trained for: up to 5 kg and 5 times the weight, 40 to 1200 rad/s^2 of roll."""
    family = load_family("any")
    assert family is not None
    v = family.draw(drawn)
    roll = 2 * v.rotor_thrust_max * np.abs(v.rotor_position[:, 0, 1]) / v.inertia[:, 0]
    strong = 4 * v.rotor_thrust_max / (v.mass * GRAVITY)
    return (v.mass < 5) & (strong < 5) & (roll > 40) & (roll < 1200)


def row(name: str, starts: str, delay: float, e: Episodes, known: np.ndarray) -> dict[str, Any]:
    """Of the table; `known`: which vehicles are of RAPTOR's training."""
    return {
        "policy": name,
        "starts": starts,
        "delay": f"{1e3 * delay:.0f} ms",
        "success, %": round(100 * float(np.mean(e.success)), 1),
        "of RAPTOR's kind, %": round(100 * float(np.mean(e.success[known])), 1),
        "median error, cm": round(100 * float(np.median(e.final_error)), 2),
        "90 % below, cm": round(100 * float(np.quantile(e.final_error, 0.9)), 2),
    }


def main() -> None:
    """Fly all of them; write the table."""
    options = arguments(__doc__ or "", rotors="any/hover_rotors", form="", ctbr="any/hover", vehicles=1000)
    prepare("cpu")
    drawn = np.random.default_rng(SEED).random((options.vehicles, DRAWN))
    rows, known = [], alike(drawn)
    with tempfile.TemporaryDirectory() as folder:
        theirs, form = str(raptor(Path(folder))), options.form or str(Path(folder) / "form")
        if not options.form:
            command = ["train", "hover", "--vehicle", "any", "--preset", "raptor", "--no-plots", "--out", form]
            subprocess.run([sys.executable, "-m", "e2efly", *command], check=True)
        for name, policy, starts, delays in (
            ("ours, rotors", options.rotors, "hover's", ROTORS),
            ("ours, CTBR", options.ctbr, "hover's", RATES),
            ("ours, RAPTOR's form", form, "hover's", ROTORS),
            ("ours, RAPTOR's form", form, "within 0.5 m", ROTORS),
            ("RAPTOR", theirs, "hover's", ROTORS),
            ("RAPTOR", theirs, "within 0.5 m", ROTORS),
        ):
            flown = candidate(policy, "any").policy
            contract, task = flown.contract, NEAR if starts == "within 0.5 m" else HoverConfig()
            for delay in delays:
                config = EnvConfig(
                    vehicle="any", command_mode=contract.action.mode, control_rate=contract.control_rate_hz,
                    action_latency=(delay, delay), past_actions=contract.past_actions,
                )  # fmt: skip
                env = Env.of(task, RewardConfig({"prog2": 1.0}), config)
                rows.append(row(name, starts, delay, fly(env, act_of(flown), drawn), known))
                print(rows[-1], flush=True)
    print(table(rows))
    write("raptor", options.json, {"table": rows, "vehicles": options.vehicles, "seed": SEED})


if __name__ == "__main__":
    main()
