"""Hover of frames with 4 to 8 rotors, tilted up to 30 degrees and lopsided, by the zoo's one policy of them: 1000
unseen frames that a linear programme calls feasible, some of them in MuJoCo, and the vehicles that ship.

    python benchmarks/multirotor.py [--policy multirotor/hover] [--frames 1000] [--mujoco 60] [--seed 0]

A frame is feasible if thrusts inside of their limits hover level, and leave `MARGIN` of torque about each axis alone,
in both directions: of weight times arm, of yaw times `torque_ratio`. The frames are those of the family `multirotor`,
whose law straightens a frame until the thrusts of smallest norm do so ("straightened"), and those that it draws
first, of which the linear programme refuses some ("as drawn"). Starts and success are those of `e2efly eval`, in
still air: no training draws from them. Each batch is written at once, and a script that was stopped goes on where it
was: delete the file to fly anew. Tune with `--seed 100 --json FILE`.
"""

import dataclasses
import json
from contextlib import closing
from typing import Any

import numpy as np
from common import RESULTS, arguments, table, write
from scipy.optimize import linprog

import e2efly
from e2efly.environment import UNSEEN, Env, EnvState, random_key
from e2efly.environment.episodes import Episodes, run_stepwise
from e2efly.policy.runtime import Runtime
from e2efly.simulation.device import prepare
from e2efly.validation.candidate import Candidate, candidate
from e2efly.validation.evaluation import act_of
from e2efly.validation.plant import RigidState
from e2efly.validation.plant_flight import flying, together
from e2efly.validation.plants import find_plant
from e2efly.validation.starts import draw_starts
from e2efly.vehicles.family import _loaded, measured
from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.loading import vehicle_names
from e2efly.vehicles.vehicle import Vehicle, allocation_matrix

MARGIN = 0.1
BATCH = 250
LAWS = {"straightened": True, "as drawn": False}


def feasible(vehicle: Vehicle) -> bool:
    """Whether the linear programme finds thrusts that hover with `MARGIN` of torque about each axis alone."""
    arm, weight = measured(vehicle)["arm"][0], vehicle.mass * GRAVITY
    units = weight * np.array([1.0, arm, arm, vehicle.torque_ratio])
    rows, limits = allocation_matrix(vehicle) / units[:, None], [vehicle.thrust_range] * vehicle.rotor_count
    for axis in (1, 2, 3):
        for torque in (MARGIN, -MARGIN):
            asked = np.array([1.0, 0.0, 0.0, 0.0])
            asked[axis] = torque
            if linprog(np.zeros(len(limits)), A_eq=rows, b_eq=asked, bounds=limits).status != 0:
                return False
    return True


def fly(found: Candidate, env: Env, seed: int, batch: int) -> tuple[Episodes, EnvState, list[Vehicle]]:
    """Episodes of a batch, the states at their starts, and their vehicles."""
    assert env.family is not None
    key = random_key(seed, UNSEEN, batch)
    flown, first = run_stepwise(env, act_of(found.policy), key, BATCH, env.episode_steps)
    drawn = np.asarray(first.family, np.float64)
    return flown, first, [_loaded(env.family.draw(u), f"frame_{batch}_{i}") for i, u in enumerate(drawn)]


def in_mujoco(found: Candidate, env: Env, seed: int, first: EnvState, i: int, vehicle: Vehicle) -> bool:
    """Whether the i-th start succeeds in MuJoCo, too."""
    (course,) = draw_starts(env, 1, seed).courses
    state = first.vehicle
    start = RigidState(
        *(np.asarray(getattr(state, k)[i], float) for k in ("position", "velocity", "quaternion", "body_rate"))
    )
    with closing(find_plant("mujoco").of(vehicle, found.policy.contract)) as plant:
        runtime = Runtime.of(found.policy, course, vehicle, imu=True, rotors=True)
        late = max(float(first.action_latency[i]) - plant.latency, 0.0)
        (flight,) = together([flying(runtime, plant, start, float(env.task.episode_s), late)])
    return flight.success


def frame_row(vehicle: Vehicle, flown: Episodes, i: int) -> dict[str, Any]:
    """What is kept of a frame and its episode."""
    return {
        "rotors": vehicle.rotor_count, "tilt": round(float(np.degrees(measured(vehicle)["tilt"][0])), 1),
        "success": bool(flown.success[i]), "crashed": bool(flown.crashed[i]),
        "error": round(float(flown.final_error[i]), 5),
    }  # fmt: skip


def frames_of(batches: list[dict[str, Any]], law: str) -> list[dict[str, Any]]:
    """The feasible frames of a law."""
    columns = [one["feasible"] for one in batches if one["frames"] == law]
    return [dict(zip(some, frame, strict=True)) for some in columns for frame in zip(*some.values(), strict=True)]


def feasible_share(batches: list[dict[str, Any]], law: str) -> str:
    """The share of a law's frames that the linear programme calls feasible."""
    drawn = sum(one["drawn"] for one in batches if one["frames"] == law)
    return f"{100 * len(frames_of(batches, law)) / max(drawn, 1):.0f} %"


def parts(kept: list[dict[str, Any]]) -> dict[str, list[dict[str, Any]]]:
    """All frames, those of each number of rotors, and the most tilted ones."""
    found = {"all": kept}
    found |= {f"{n} rotors": [one for one in kept if one["rotors"] == n] for n in range(4, 9)}
    return found | {"tilted 20 degrees or more": [one for one in kept if one["tilt"] >= 20]}


def row(law: str, what: str, some: list[dict[str, Any]], share: str) -> dict[str, Any]:
    """Of the table."""
    errors = [one["error"] for one in some]
    return {
        "frames": law, "feasible": share, "of them": what, "count": len(some),
        "success, %": round(100 * float(np.mean([one["success"] for one in some])), 1),
        "crashed": sum(one["crashed"] for one in some),
        "median error, cm": round(100 * float(np.median(errors)), 2),
        "90 % below, cm": round(100 * float(np.quantile(errors, 0.9)), 2),
    }  # fmt: skip


def main() -> None:
    """Fly what the file does not have yet, print the tables, write the figures."""
    options = arguments(__doc__ or "", policy="multirotor/hover", frames=1000, mujoco=60, seed=0)
    prepare("cpu")
    path = options.json or RESULTS / "multirotor.json"
    known = json.loads(path.read_text()) if path.exists() else {"batches": [], "mujoco": [], "named": []}
    batches, mujoco, named = known["batches"], known["mujoco"], known["named"]
    found = candidate(options.policy, "multirotor")
    env = found.environment(found.task).undisturbed()
    assert env.family is not None

    def keep() -> None:
        rows = [
            row(law, what, some, feasible_share(batches, law))
            for law in LAWS
            for what, some in parts(frames_of(batches, law)[: options.frames]).items()
            if some
        ]
        flown = f"{sum(one['success'] for one in mujoco)} of {len(mujoco)}"
        about = {"seed": options.seed, "margin": MARGIN, "success in MuJoCo": flown}
        write("multirotor", options.json, {
            "table": rows, **about, "named": named, "mujoco": mujoco, "batches": batches,
        })  # fmt: skip
        print(table(rows), named, flown, sep="\n", flush=True)

    for law, straightened in LAWS.items():
        judged = dataclasses.replace(env, family=dataclasses.replace(env.family, straightened=straightened))
        while len(frames_of(batches, law)) < options.frames:
            batch = sum(one["frames"] == law for one in batches)
            flown, _, vehicles = fly(found, judged, options.seed, batch)
            good = [i for i, vehicle in enumerate(vehicles) if feasible(vehicle)]
            frames = [frame_row(vehicles[i], flown, i) for i in good]
            columns = {name: [frame[name] for frame in frames] for name in frames[0]}
            batches.append({"frames": law, "drawn": BATCH, "feasible": columns})
            keep()
    if len(mujoco) < options.mujoco:
        judged = dataclasses.replace(env, family=dataclasses.replace(env.family, straightened=False))
        _, first, vehicles = fly(found, judged, options.seed, 0)
        good = [i for i, vehicle in enumerate(vehicles) if feasible(vehicle)]
        for i in good[len(mujoco) : options.mujoco]:
            flew = in_mujoco(found, judged, options.seed, first, i, vehicles[i])
            mujoco.append({"rotors": vehicles[i].rotor_count, "success": flew})
            keep()
    for name in vehicle_names():
        if not any(one["vehicle"] == name for one in named):
            e = e2efly.evaluate(options.policy, options.frames, vehicle=name).flown["hover"]
            share, error = 100 * float(np.mean(e.success)), 100 * float(np.median(e.final_error))
            named.append({"vehicle": name, "success, %": round(share, 1), "median error, cm": round(error, 2)})
            keep()


if __name__ == "__main__":
    main()
