"""Success of the shipped policies of the visual tasks over 1000 unseen starts and worlds, and under a D435i's noise.

    python benchmarks/visual_tasks.py [--cases land_visual avoid ...] [--algos bptt ppo] [--seeds 3] [--json FILE]

A case is a task, for racing with the track's name behind a colon. Rows of the file that are not measured anew stay.
Seconds are from the start of the training process, with an empty compilation cache. Depth is flown both clean and with
the noise of a D435i, whatever the policy was trained with, always at the vehicle's latency of 0.060 s.
"""

import dataclasses
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from common import arguments, table, with_earlier, write

from e2efly.device import prepare, wide_vectors

prepare("cpu")

import jax  # noqa: E402
import numpy as np  # noqa: E402

from e2efly.config import ImageNoiseConfig  # noqa: E402
from e2efly.env import Env, random_key  # noqa: E402
from e2efly.episodes import run_episodes, wilson  # noqa: E402
from e2efly.learn.programs import acting  # noqa: E402
from e2efly.learn.rundir import RunDirectory  # noqa: E402
from e2efly.learn.runner import load_policy_weights  # noqa: E402
from e2efly.learn.setup import Setup  # noqa: E402

CASES = ["land_visual", "avoid", "race_clutter:s_shaped", "race_clutter:circle_3d", "race_clutter:j_shaped"]
BATCH, FLIGHTS = 250, 1000


def train(case: str, algo: str, seed: int, out: Path) -> dict[str, Any]:
    """The summary of a full run of the preset."""
    task, _, track = case.partition(":")
    command = [
        sys.executable, "-m", "e2efly", "train", task, "--algo", algo, "--seed", str(seed), "--out", str(out),
        "--no-plots", "--device", "cpu", *(["--task.track", track] if track else []),
    ]  # fmt: skip
    with tempfile.TemporaryDirectory() as cache:
        subprocess.run(command, env=os.environ | {"XDG_CACHE_HOME": cache}, stdout=subprocess.DEVNULL, check=True)
    return RunDirectory(out).read_json("summary.json")


def flown(out: Path, noise: ImageNoiseConfig) -> dict[str, float]:
    """Success of a run's policy with a noise on its cameras, by criterion."""
    run = RunDirectory(out)
    config = run.config()
    setup = Setup.of(config)
    weights = load_policy_weights(setup, run, "best")
    cameras = tuple(dataclasses.replace(c, noise=noise, noise_share=1.0) for c in config.env.cameras)
    found = {}
    for name, suite in config.task.criteria().items():
        env = Env.of(suite, config.reward, dataclasses.replace(config.env, cameras=cameras))
        fly = jax.jit(
            lambda env, key: run_episodes(env, acting(setup.actor, weights), key, BATCH, setup.episode_steps),
            compiler_options=wide_vectors(BATCH),
        )
        each = [fly(env, random_key(7, i)) for i in range(FLIGHTS // BATCH)]
        found[name] = float(np.mean([np.mean(e.success) for e in each]))
    return found


def by_noise(out: Path) -> dict[str, dict[str, float]]:
    """Success of a run's policy with clean images, and with a D435i's noise where it sees depth."""
    depth = all(camera.sees == "depth" for camera in RunDirectory(out).config().env.cameras)
    noises = {"clean": ImageNoiseConfig()} | ({"noisy": ImageNoiseConfig(d435i=True)} if depth else {})
    return {name: flown(out, noise) for name, noise in noises.items()}


def main() -> None:
    """Train, print a table, write JSON."""
    options = arguments(__doc__ or "", cases=CASES, algos=["bptt", "ppo"], seeds=3)
    rows, every = [], []
    for algo in options.algos:
        for case in options.cases:
            runs = []
            for seed in range(options.seeds):
                with tempfile.TemporaryDirectory() as folder:
                    summary = train(case, algo, seed, Path(folder) / "run")
                    runs.append({"case": case, **summary, "flown": by_noise(Path(folder) / "run")})
            every += runs
            for criterion in (name for name in runs[0]["shipped"] if name != "update"):
                of = [r["shipped"][criterion] for r in runs]
                clean = [r["flown"]["clean"][criterion] for r in runs]
                low, _ = wilson(round(sum(clean) * FLIGHTS), FLIGHTS * len(clean))
                rows.append(
                    {
                        "algorithm": algo,
                        "task": case if criterion == case.partition(":")[0] else f"{case}, {criterion}",
                        "success, every seed, %": " ".join(f"{100 * share:.1f}" for share in clean),
                        "at least (95 %)": f"{100 * low:.1f}",
                        "with a D435i's noise": " ".join(
                            f"{100 * r['flown']['noisy'][criterion]:.1f}" if "noisy" in r["flown"] else "-"
                            for r in runs
                        ),
                        "time of a success, s": " ".join(f"{d['seconds_of_success']:.1f}" for d in of),
                        "top speed, m/s": " ".join(f"{d['top_speed_m_s']:.1f}" for d in of),
                        "trained, s": " ".join(f"{r['seconds_trained_from_process_start']:.0f}" for r in runs),
                        "steps, M": " ".join(f"{r['env_steps'] / 1e6:.1f}" for r in runs),
                    }
                )
                print(rows[-1], flush=True)
            whole = with_earlier("visual_tasks", options.json, "table", ("algorithm", "task"), rows)
            runs = with_earlier("visual_tasks", options.json, "runs", ("algorithm", "case"), every)
            write("visual_tasks", options.json, {"table": whole, "runs": runs})
    print(table(rows))


if __name__ == "__main__":
    main()
