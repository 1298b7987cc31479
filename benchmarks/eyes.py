"""Races by a camera and an IMU alone: the pose source `gates:` under the zoo's race policies, as they are.

    python benchmarks/eyes.py [--flights 50] [--seed 9000000] [--rows | --firmware 5]
    python benchmarks/eyes.py --colours gates.onnx [--looks FILE.py:NAME]

On MuJoCo, on four tracks of twice their size, on which such races are fast, and on random tracks. Each flight draws the
mounting of its camera (2 degrees), the age of its images (20 to 60 ms, of which the estimator knows the middle), a
rolling shutter of 16 ms, lost images (5 %), the places of the gates (2 cm from the map), and the errors of its IMU.
With `--rows`, rows that the estimator was not made for, and the vehicles of the stress test. With `--colours FILE`, a
camera that gives colours: the world has looks that are kept apart from the training of `gate_masks.py`, or those that
`--looks` names, and every image passes through the network in that file. With `--firmware`, whole flights through the
real Betaflight firmware, whose IMU comes by MSP. Parts that are not asked for stay as they are in the file.
"""

import dataclasses
import json
import math
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from common import RESULTS, arguments, table, write

from e2efly.config.registry import load
from e2efly.courses.tracks import load_track, track_text
from e2efly.policy.loader import load_policy
from e2efly.policy.zoo import policy_file
from e2efly.simulation.device import compute_at_once, prepare
from e2efly.simulation.scenes.gate_looks import KEPT_APART
from e2efly.tasks.route import usual_route
from e2efly.validation import firmware_program
from e2efly.validation.gate_pose import RACER, GateCamera
from e2efly.validation.plant_stress import stress
from e2efly.validation.plant_validation import Pose, validate
from e2efly.validation.rehearsal import rehearse
from e2efly.vehicles.loading import load_vehicle

SCALE = 2.0
"""Factor on the ground plan of the tracks."""
TRACKS = {"four_gates": 3, "circle_3d": 3, "s_shaped": 1, "j_shaped": 1}
"""Laps of each."""
CONDITIONS: dict[str, dict[str, Any]] = {
    "as drawn": {},
    "a perfect camera": {
        "camera": dataclasses.replace(RACER, angle_spread=0.0, latency=(0.0, 0.0)), "readout": 0.0, "survey": 0.0,
        "lost": 0.0,
    },
    "camera 5 degrees askew": {"camera": dataclasses.replace(RACER, angle_spread=math.radians(5))},
    "images 0 to 120 ms old": {"camera": dataclasses.replace(RACER, latency=(0.0, 0.12))},
    "the shutter's time unknown": {"told_readout": False},
    "gates 5 cm from the map": {"survey": 0.05},
    "half of the images lost": {"lost": 0.5},
    "15 images a second": {"camera": dataclasses.replace(RACER, rate=15.0)},
    "320 x 180 pixels": {"camera": dataclasses.replace(RACER, width=320, height=180)},
    "an IMU of 100 Hz": {"imu_rate": 100.0},
}  # fmt: skip
"""What differs from `GateCamera()`. The estimator is told the camera as it should be."""


def main() -> None:
    """Fly, print the tables, write the figures."""
    args = arguments(__doc__ or "", flights=50, seed=9_000_000, rows=False, colours="", looks="", firmware=0)
    compute_at_once()
    prepare("cpu")
    path = args.json or RESULTS / "eyes.json"
    kept = json.loads(path.read_text()) if path.exists() else {}
    parts = kept.get("parts", {})
    with tempfile.TemporaryDirectory() as folder:
        if args.rows:
            setups = {name: GateCamera(**changed) for name, changed in CONDITIONS.items()}
            parts["conditions"] = [condition(name, setup, args.flights, args.seed) for name, setup in setups.items()]
            parts["stress"] = stressed(args.flights // 4, args.seed)
        elif args.colours:
            looks, name = (load(args.looks).looks, args.looks) if args.looks else (KEPT_APART, "looks kept apart")
            setup = GateCamera(colours=f"onnx:{args.colours}", looks=looks)
            parts["colours"] = [condition(f"from colours, {name}", setup, args.flights, args.seed)]
        elif args.firmware:
            parts["firmware"] = firmware(args.firmware, args.seed)
        else:
            parts["tracks"] = tracks(args.flights, args.seed, Path(folder))
    for name, rows in parts.items():
        print(f"{name}:\n{table(rows)}")
    others = [parts[name] for name in ("conditions", "stress", "colours", "firmware") if name in parts]
    write("eyes", args.json, {"seed": args.seed, "parts": parts, "table": parts.get("tracks", []), "tables": others})


def tracks(flights: int, seed: int, folder: Path) -> list[dict[str, Any]]:
    """Each track, and random tracks that no training drew."""
    rows = []
    for name, laps in TRACKS.items():
        file = folder / f"{name}.toml"
        file.write_text(track_text(load_track(name).enlarged(SCALE)))
        rows.append(flown(name, "race_any", {"track": str(file), "laps": laps, "episode_s": 40.0}, flights, seed))
    rows.append(flown("random tracks", "race_any", {}, flights, seed))
    rows.append(flown("four_gates, its own size", "race", {"laps": 3, "episode_s": 20.0}, flights, seed))
    return rows


def condition(name: str, setup: GateCamera, flights: int, seed: int) -> dict[str, Any]:
    """A camera on the track and under the policy of the zoo's fastest race."""
    return flown(name, "race", {"laps": 3, "episode_s": 20.0}, flights, seed, setup)


def flown(
    name: str, policy: str, task: dict[str, Any], flights: int, seed: int, setup: GateCamera | None = None
) -> dict[str, Any]:
    """A policy's flights on MuJoCo, as they are told by the gates and as they are told the truth."""
    began = time.perf_counter()
    seen = validate(policy, "mujoco", flights, task=task, seed=seed, pose=setup or GateCamera())
    (found,) = seen.criteria.values()
    error = found.pose_error
    assert error is not None
    each = [
        float(np.sqrt(np.mean(np.sum((f.estimate - f.position[: len(f.estimate)]) ** 2, axis=1))))
        for f in found.flights
        if f.estimate is not None and len(f.estimate)
    ]
    speed = [
        float(np.linalg.norm(np.diff(f.position, axis=0), axis=1).sum() / f.time[-1])
        for f, success in zip(found.flights, found.flown.success, strict=True)
        if success
    ]
    row = {
        "track": name,
        "policy": policy,
        "success": f"{100 * float(np.mean(found.flown.success)):.0f} % of {flights}",
        "told the truth, in training": f"{100 * float(np.mean(found.trained.success)):.0f} %",
        "mean speed": f"{np.mean(speed):.1f} m/s" if speed else "none",
        "pose error, RMS": f"{100 * error[0]:.1f} cm",
        "of 95 % of the flights": f"{100 * float(np.quantile(each, 0.95)):.1f} cm",
        "largest": f"{100 * error[1]:.0f} cm",
    }
    print(f"{name}: {row['success']}, {row['pose error, RMS']}, {time.perf_counter() - began:.0f} s", flush=True)
    return row


def stressed(flights: int, seed: int) -> list[dict[str, Any]]:
    """The rows of the stress test on MuJoCo, told by the gates and told the truth."""
    rows: dict[str, dict[str, Any]] = {}
    poses: dict[str, Pose] = {"told the truth": "truth", "told by the gates": "gates"}
    for told, pose in poses.items():
        for name, success in stress("race", "mujoco", flights, seed=seed, pose=pose).success.items():
            rows.setdefault(name, {"row": name})[told] = f"{100 * success:.0f} %"
    return list(rows.values())


def firmware(flights: int, seed: int) -> list[dict[str, Any]]:
    """Whole flights through the firmware: take-off, hover, three laps, landing, by the gates alone."""
    built, vehicle, rows = firmware_program.chosen(), load_vehicle("vis_r"), []
    for task, track in (("race", "four_gates"), ("race_any", "circle_3d")):
        policy = load_policy(policy_file(task, "vis_r"))
        route = dataclasses.replace(usual_route(policy.contract), track=track, laps=3, outside=True)
        made = [
            rehearse(built, policy, vehicle, seed=seed + i, route=route, gates=GateCamera()) for i in range(flights)
        ]
        rows.append({
            "track": track,
            "policy": task,
            "complete": f"{sum(f.complete for f in made)} of {flights}",
            "success": f"{sum(f.success for f in made)} of {flights}",
            "the policy, each flight": "; ".join(f.told for f in made),
            "top speed": f"{max(f.top_speed for f in made):.1f} m/s",
        })  # fmt: skip
        print(f"{track}: {rows[-1]['complete']} complete, {rows[-1]['success']} succeed", flush=True)
    return rows


if __name__ == "__main__":
    main()
