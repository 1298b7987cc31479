"""Racing by eye end to end: a run of `race_eyes` on each of its tracks, in the simulator and through the real firmware.

    python benchmarks/race_eyes.py [--run DIR] [--episodes 1000] [--flights 20] [--whole 5] [--seed 9000000]

Without a run, `e2efly train race_eyes --seed 0` makes one, which draws none of these starts. `--flights` starts of each
track fly on MuJoCo and on the plant of the real Betaflight firmware. `--whole` flights take off, fly three laps of
four_gates or of circle_3d, and land, through the firmware, told their place by motion capture but for the policy. Rows
of the stress have a quarter of the starts.
"""

import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from common import arguments, table, write

from e2efly.environment.episodes import summary
from e2efly.environment.stress_rows import ALL
from e2efly.policy.loader import load_policy
from e2efly.policy.zoo import policy_file
from e2efly.runs.rundir import RunDirectory
from e2efly.simulation.device import compute_at_once, prepare
from e2efly.validation import firmware_program
from e2efly.validation.candidate import candidate
from e2efly.validation.evaluation import evaluate
from e2efly.validation.plant_validation import validate
from e2efly.validation.rehearsal import rehearse
from e2efly.validation.scenery import Scenery
from e2efly.validation.stress import stress
from e2efly.vehicles.loading import load_vehicle

ROWS = (
    "nominal", "mass x1.25", "thrust x0.8", "delay +40 ms", "camera 3 degrees and 1 cm off", "images 40 ms older",
    "images half as often", ALL,
)  # fmt: skip
LAPPED = ("four_gates", "circle_3d")
"""Tracks of the whole flights."""


def main() -> None:
    """Train, if there is no run, and measure."""
    args = arguments(__doc__ or "", run="", episodes=1000, flights=20, whole=5, seed=9_000_000)
    compute_at_once()
    prepare("cpu")
    with tempfile.TemporaryDirectory() as folder:
        run = Path(args.run or Path(folder) / "run")
        if not args.run:
            command = ["train", "race_eyes", "--seed", "0", "--no-plots", "--out", str(run)]
            subprocess.run([sys.executable, "-m", "e2efly", *command], check=True)
        measure(run, args)


def measure(run: Path, args: Any) -> None:
    """Fly a run, print the tables, write the figures."""
    flown = {
        name: {row: {track: summary(e) for track, e in of.items()} for row, of in stressed(run, name, args).items()}
        for name in ("nominal", "rows")
    }
    tables = [tracks(run, flown["nominal"]["nominal"], args), rows(flown["rows"])]
    tables += [whole(run, args)] if args.whole else []
    for each in tables:
        print(table(each))
    about = RunDirectory(run).read_json("summary.json")
    trained = {name: about[name] for name in ("seconds_trained_from_process_start", "env_steps")}
    write("race_eyes", args.json, {"seed": args.seed, "trained": trained, "table": tables[0], "tables": tables[1:]})


def stressed(run: Path, name: str, args: Any) -> dict[str, Any]:
    """The episodes of the nominal row, or fewer of every row, by criterion."""
    chosen, episodes = (ROWS[:1], args.episodes) if name == "nominal" else (ROWS, args.episodes // 4)
    return stress(run, episodes, rows=chosen, seed=args.seed).trained.flown


def tracks(run: Path, nominal: dict[str, Any], args: Any) -> list[dict[str, Any]]:
    """Each track: with the vehicle of the file, as the training draws vehicles and cameras, and on plants."""
    drawn = evaluate(run, args.episodes, seed=args.seed).flown
    plants = {plant: validate(run, plant, args.flights, seed=args.seed) for plant in ("mujoco", "betaflight")}
    return [
        {
            "track": track,
            "vehicle of the file": f"{100 * found['success']:.1f} % of {args.episodes}",
            "mean speed": f"{found['mean_speed_m_s']:.1f} m/s",
            "random vehicles, air and cameras": f"{100 * float(drawn[track].success.mean()):.1f} %",
            **{
                plant: f"{int(of.criteria[track].flown.success.sum())} of {args.flights}"
                for plant, of in plants.items()
            },
        }
        for track, found in nominal.items()
    ]


def rows(flown: dict[str, dict[str, Any]]) -> list[dict[str, str]]:
    """Each row of the stress."""
    return [
        {"row": name, **{track: f"{100 * found['success']:.0f} %" for track, found in of.items()}}
        for name, of in flown.items()
    ]


def whole(run: Path, args: Any) -> list[dict[str, str]]:
    """Whole flights through the firmware."""
    policy, vehicle, made = load_policy(policy_file(run)), load_vehicle("vis_r"), []
    for track in LAPPED:
        asked = candidate(run, task={"track": (track,), "laps": 3, "episode_s": 40.0})
        env = asked.environment(*asked.task.criteria().values())
        flights = [
            rehearse(firmware_program.chosen(), policy, vehicle, seed=seed, scenery=Scenery.draw(env, seed))
            for seed in range(args.seed, args.seed + args.whole)
        ]
        made.append({
            "track": track,
            "complete": f"{sum(f.complete for f in flights)} of {args.whole}",
            "success": f"{sum(f.success for f in flights)} of {args.whole}",
            "each": "; ".join(f.told for f in flights),
        })  # fmt: skip
    return made


if __name__ == "__main__":
    main()
