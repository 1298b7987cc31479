"""Hover of 1000 unseen vehicles by one policy: ours and RAPTOR, in the same run, plant and starts, by delay.

    python benchmarks/raptor.py [--rotors RUN] [--ctbr POLICY] [--vehicles 1000]

RAPTOR (J. Eschmann et al., RAPTOR: A Foundation Policy for Quadrotor Control, 2025) is `foundation-policy` 1.0.2 of
PyPI, installed on first use into an environment of its own in the user's cache folder; its figures are those of its
shipped network, a hundred questions a second. It commands the rotors: its command c in [-1, 1] sets the share (c + 1) /
2 of the rotor's full speed, which is the quadratic thrust curve that it was trained with. Ours by rotors is the preset
`rotors` of hover, trained here unless `--rotors` names its run; ours by collective thrust and body rates is the zoo's.

Vehicles are drawn by `e2efly.vehicles.family` with seed 7; "of RAPTOR's kind" are those within the ranges that it was
trained on, as far as mass, thrust and roll say it. Starts: those of hover, heading along x, to which RAPTOR turns; for
RAPTOR also starts within 0.5 m of the target, level and at rest. With `clip` it is shown at most 0.5 m of error per
axis. Success: within 0.1 m for the last second of 8 s.
"""

import dataclasses
import subprocess
import sys
import tempfile
from collections.abc import Callable
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
from e2efly.simulation.device import prepare
from e2efly.simulation.physics.body import hover_rotor_speed
from e2efly.simulation.physics.rotation import from_euler, multiply, yaw
from e2efly.tasks.hover import HoverConfig
from e2efly.validation.evaluation import act_of, candidate
from e2efly.vehicles.family import DRAWN, load_family
from e2efly.vehicles.gravity import GRAVITY

NEEDS = "foundation-policy==1.0.2", "numpy"
SEED, BATCH = 7, 250
ROTORS, RATES = (0.0, 0.01, 0.02, 0.03), (0.0, 0.03, 0.06, 0.09, 0.12)
"""Delays, s."""
BACK = [1, 0, 2, 3]
"""Where each of our rotors (rear right, front right, rear left, front left) stands in RAPTOR's order: front right, rear
right, rear left, front left."""
NEAR = HoverConfig(position=0.5, velocity=0.0, tilt=0.0, body_rate=0.0)
UNITS = 16
"""Of RAPTOR's GRU."""


def raptor(curve: Any, clip: float) -> Act:
    """RAPTOR on vehicles whose thrust is a share `curve` linear in the rotor speed, and else quadratic."""
    sys.path.append(str(packages(*NEEDS)))
    from foundation_policy import Raptor  # type: ignore[import-not-found]

    network = Raptor()
    cell = next(layer for layer in network.layers if hasattr(layer, "reset"))

    def asked(seen: np.ndarray, memory: np.ndarray) -> np.ndarray:
        cell.state = np.asarray(memory, np.float64)
        command = network.evaluate_step(np.asarray(seen, np.float64))
        return np.concatenate([command, cell.state], axis=1).astype(np.float32)

    def act(observation: Any, images: Any, memory: Any) -> tuple[Any, Any]:
        del images
        error, velocity, rate = observation[:, :3], observation[:, 7:10], observation[:, 10:13]
        w, x, y, z = observation[:, 3:7].T
        turn = [
            1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
            2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
            2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y),
        ]  # fmt: skip
        last, state = memory[:, :4], memory[:, 4:]
        seen = jnp.concatenate([jnp.clip(-error, -clip, clip), jnp.stack(turn, axis=1), velocity, rate, last], axis=1)
        shape = jax.ShapeDtypeStruct((seen.shape[0], 4 + UNITS), jnp.float32)
        out = jax.pure_callback(asked, shape, seen, state)
        command = jnp.clip(out[:, :4], -1, 1)
        speed = (command[:, jnp.array(BACK)] + 1) / 2
        share = (1 - curve[:, None]) * speed**2 + curve[:, None] * speed
        return 2 * share - 1, jnp.concatenate([command, out[:, 4:]], axis=1)

    first = np.concatenate([np.zeros(4), cell.initial_hidden_state.reshape(-1)]).astype(np.float32)
    return Act(act, lambda n: jnp.tile(jnp.asarray(first), (n, 1)))


def fly(env: Env, act_for: Callable[[Any], Act], drawn: np.ndarray, task: HoverConfig) -> Episodes:
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
        parts.append(run_stepwise(env, act_for(u), key, BATCH, steps, altered=partial(altered, u))[0])
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
    options = arguments(__doc__ or "", rotors="", ctbr="any/hover", vehicles=1000)
    prepare("cpu")
    family = load_family("any")
    assert family is not None
    drawn = np.random.default_rng(SEED).random((options.vehicles, DRAWN))
    rows, known = [], alike(drawn)
    with tempfile.TemporaryDirectory() as folder:
        run = options.rotors or str(Path(folder) / "rotors")
        if not options.rotors:
            command = ["train", "hover", "--vehicle", "any", "--preset", "rotors", "--no-plots", "--out", run]
            subprocess.run([sys.executable, "-m", "e2efly", *command], check=True)
        for name, policy, mode, delays in (
            ("ours, rotors", run, "rotor_share", ROTORS), ("ours, CTBR", options.ctbr, "ctbr", RATES),
        ):  # fmt: skip
            found = candidate(policy, "any")
            rate, seen = found.policy.contract.control_rate_hz, found.policy.contract.slices["past_actions"]
            for delay in delays:
                config = EnvConfig(
                    vehicle="any", command_mode=mode, control_rate=rate, action_latency=(delay, delay),
                    past_actions=(seen.stop - seen.start) // 4,
                )  # fmt: skip
                task = HoverConfig()
                env = Env.of(task, RewardConfig({"prog2": 1.0}), config)
                flown = fly(env, lambda u: act_of(found.policy), drawn, task)  # noqa: B023
                rows.append(row(name, "hover's", delay, flown, known))
                print(rows[-1], flush=True)
    for starts, task, clip in (("within 0.5 m", NEAR, np.inf), ("hover's", HoverConfig(), 0.5)):
        for delay in ROTORS:
            config = EnvConfig(
                vehicle="any", command_mode="rotor_share", control_rate=100.0, action_latency=(delay, delay),
                past_actions=0,
            )  # fmt: skip
            env = Env.of(task, RewardConfig({"prog2": 1.0}), config)
            flown = fly(env, lambda u: raptor(curve_of(u), clip), drawn, task)  # noqa: B023
            rows.append(row("RAPTOR", starts if clip > 1 else f"{starts}, clip", delay, flown, known))
            print(rows[-1], flush=True)
    print(table(rows))
    write("raptor", options.json, {"table": rows, "vehicles": options.vehicles})


def curve_of(u: Any) -> Any:
    """The share of the thrust at full speed that grows linearly with it, of each vehicle."""
    family = load_family("any")
    assert family is not None
    v = family.draw(u)
    return v.thrust_map[:, 1] * v.rotor_speed_max / v.rotor_thrust_max


if __name__ == "__main__":
    main()
