"""Racing by eye end to end: the zoo's `race_eyes` on each of its tracks, in the simulator and through real firmware.

    python benchmarks/race_eyes.py [--policy race_eyes] [--episodes 1000] [--flights 20] [--whole 5] [--seed 9000000]

No training draws these starts. `--flights` starts of each track fly on MuJoCo and on the plant of the real Betaflight
firmware. `--whole` flights take off, fly three laps of four_gates or of circle_3d, and land, through the firmware:
told their place by motion capture but for the policy, and again told no place at all (`--pose imu`). Other rows of the
stress have a quarter of the starts.
"""

import dataclasses
from typing import Any

import numpy as np
from common import arguments, table, write

from e2efly.config import EnvConfig
from e2efly.config.changes import differing
from e2efly.environment.episodes import summary
from e2efly.environment.stress_rows import ALL
from e2efly.policy.loader import load_policy
from e2efly.policy.zoo import policy_file
from e2efly.simulation.device import compute_at_once, prepare
from e2efly.tasks.race_eyes import ABOUT
from e2efly.tasks.route import usual_route
from e2efly.validation import firmware_program
from e2efly.validation.bridge_session import FlownSession
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
LOW = 0.1
"""Height of a centre of mass that nearly stands, m."""
LAPPED = ("four_gates", "circle_3d")
"""Tracks of the whole flights."""


def main() -> None:
    """Fly, print the tables, write the figures."""
    args = arguments(__doc__ or "", policy="race_eyes", episodes=1000, flights=20, whole=5, seed=9_000_000)
    compute_at_once()
    prepare("cpu")
    nominal = stress(args.policy, args.episodes, rows=ROWS[:1], seed=args.seed).trained.flown["nominal"]
    stressed = stress(args.policy, args.episodes // 4, rows=ROWS[1:], seed=args.seed).trained.flown
    tables = [tracks({track: summary(e) for track, e in nominal.items()}, args), rows({"nominal": nominal} | stressed)]
    tables += [whole(args)] if args.whole else []
    for each in tables:
        print(table(each))
    write("race_eyes", args.json, {"seed": args.seed, "table": tables[0], "tables": tables[1:]})


def tracks(nominal: dict[str, Any], args: Any) -> list[dict[str, Any]]:
    """Each track: with the vehicle of the file, as the training draws vehicles and cameras, and on plants."""
    calm = EnvConfig(cameras=candidate(args.policy).env.cameras)
    drawn = {name: value for name, (_, value) in differing(calm, ABOUT).items()}
    random = evaluate(args.policy, args.episodes, seed=args.seed, env=drawn).flown
    plants = {plant: validate(args.policy, plant, args.flights, seed=args.seed) for plant in ("mujoco", "betaflight")}
    return [
        {
            "track": track,
            "vehicle of the file": f"{100 * found['success']:.1f} % of {args.episodes}",
            "mean speed": f"{found['mean_speed_m_s']:.1f} m/s",
            "random vehicles, air and cameras": f"{100 * float(random[track].success.mean()):.1f} %",
            "their mean speed": f"{summary(random[track])['mean_speed_m_s']:.1f} m/s",
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
        {"row": name, **{track: f"{100 * float(e.success.mean()):.0f} %" for track, e in of.items()}}
        for name, of in flown.items()
    ]


def whole(args: Any) -> list[dict[str, str]]:
    """Whole flights through the firmware, with a place and without."""
    policy, vehicle, made = load_policy(policy_file(args.policy)), load_vehicle("vis_r"), []
    usual: Any = usual_route(policy.contract)
    for track in LAPPED:
        asked = candidate(args.policy, task={"track": (track,), "laps": 3, "episode_s": 40.0})
        env = asked.environment(*asked.task.criteria().values())
        route = dataclasses.replace(usual, outside=True, **(usual.whole | {"track": track, "laps": 3}))
        for placed in (True, False):
            flights = [
                rehearse(
                    firmware_program.chosen(),
                    policy,
                    vehicle,
                    seed=seed,
                    scenery=Scenery.draw(env, seed),
                    route=route,
                    placed=placed,
                )
                for seed in range(args.seed, args.seed + args.whole)
            ]
            touched = [arrival(f.flown) for f in flights]
            made.append({
                "track": track,
                "the bridge knows the place by": "motion capture" if placed else "nothing",
                "complete": f"{sum(f.complete for f in flights)} of {args.whole}",
                "success": f"{sum(f.success for f in flights)} of {args.whole}",
                "fastest touch of the ground, down and level": "{:.1f} and {:.1f} m/s".format(*np.max(touched, axis=0)),
                "each": "; ".join(f.told for f in flights),
            })  # fmt: skip
    return made


def arrival(flown: FlownSession) -> tuple[float, float]:
    """How fast a vehicle was just before it touched the ground in its landing: down and level, m/s."""
    air = [i for i in flown.where("land") if flown.position[i][2] > LOW]
    velocity = flown.velocity[air[-1]] if air else np.zeros(3)
    return float(-velocity[2]), float(np.linalg.norm(velocity[:2]))


if __name__ == "__main__":
    main()
