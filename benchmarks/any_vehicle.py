"""The zoo's policies of any vehicle: 1000 unseen vehicles, with the delays that they draw and with each delay; those
that are weak or strong; and the vehicles that ship, which they were never told of; how long a question takes.

    python benchmarks/any_vehicle.py [--policies any/hover ...] [--vehicles 1000] [--parts delays strengths named]

Rows that are not measured anew stay.
"""

import dataclasses
import json
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from common import RESULTS, arguments, table, with_earlier, write

import e2efly
from e2efly.environment import UNSEEN, random_key
from e2efly.environment.episodes import run_stepwise
from e2efly.policy.zoo import FOLDER
from e2efly.validation.candidate import candidate
from e2efly.validation.evaluation import act_of
from e2efly.vehicles.loading import load_vehicle, vehicle_file, vehicle_names

DELAYS = (0.0, 0.03, 0.06, 0.09, 0.12)
"""s."""
STRENGTHS = ((1.5, 2.0), (6.0, 14.0))
"""Ranges of the thrust over the weight. The policies learned on 1.5 to 6."""
ASKED = 5000
WEIGHED = {"vis_r": (0.7, 1.3), "vis_h": (0.75, 1.3)}
"""Vehicles that are also flown with another mass, which their files say, and the factors on it. A VIS-H of less than
0.74 of its mass has more thrust over its weight than the family."""


def rows_of(flown: dict[str, Any], what: str, delay: str) -> list[dict[str, Any]]:
    """A row for each criterion."""
    return [
        {
            "task": name,
            "vehicles": what,
            "delay": delay,
            "success, %": round(100 * float(np.mean(e.success)), 1),
            "median error, cm": round(100 * float(np.median(error(name, e))), 2),
            "90 % below, cm": round(100 * float(np.quantile(error(name, e), 0.9)), 2),
            "time of a success, s": round(float(np.mean(e.duration[e.success])), 2),
        }
        for name, e in flown.items()
    ]


def of_strength(policy: str, low: float, high: float, count: int) -> dict[str, Any]:
    """The episodes of each criterion on vehicles whose thrust over the weight is drawn from a part of the range."""
    found, flown = candidate(policy), {}
    for i, (name, suite) in enumerate(found.task.criteria().items()):
        env = found.environment(suite)
        assert env.family is not None
        ranges = dataclasses.replace(env.family.ranges, thrust_to_weight=(low, high))
        env = dataclasses.replace(env, family=dataclasses.replace(env.family, ranges=ranges))
        key = random_key(0, UNSEEN, i)
        flown[name] = run_stepwise(env, act_of(found.policy), key, count, env.episode_steps)[0]
    return flown


def error(criterion: str, e: Any) -> np.ndarray:
    """The mean along a reference; at the end of all else: of a race, from the centre of the last gate."""
    return e.mean_error if criterion in ("circle", "lemniscate") else e.final_error


def question(policy: str) -> float:
    """Median time of a question, with its checks, on one core, us."""
    loaded = e2efly.load_policy(policy)
    observation = np.zeros(loaded.contract.observation_size, np.float32)
    observation[loaded.contract.slices[loaded.contract.attitude].start] = 1.0
    images = [np.zeros(image.shape, np.float32) for image in loaded.contract.images]
    memory, taken = None, []
    for _ in range(ASKED):
        began = time.perf_counter()
        _, memory = loaded.act(observation, images, memory)
        taken.append(time.perf_counter() - began)
    return 1e6 * float(np.median(taken))


def weighed(name: str, factor: float, folder: Path) -> str:
    """The file of a shipped vehicle with another mass."""
    mass = f"{load_vehicle(name).mass:g}"
    text, file = vehicle_file(name).read_text(encoding="utf-8"), folder / f"{name}.toml"
    own = f"[mass]\nvalue = {mass}\n"
    assert own in text, f"{name}: no {own!r}"
    file.write_text(text.replace(own, f"[mass]\nvalue = {factor * float(mass):g}\n"), encoding="utf-8")
    return str(file)


def main() -> None:
    """Fly all of them; write the table."""
    zoo = json.loads((FOLDER / "zoo.json").read_text(encoding="utf-8"))
    known = [f"any/{task}" for task in zoo.get("any", {})]
    options = arguments(__doc__ or "", policies=known, vehicles=1000, parts=["delays", "strengths", "named"])
    rows: list[dict[str, Any]] = []
    asked = (
        json.loads(path.read_text())["question_us"]
        if (path := options.json or RESULTS / "any_vehicle.json").exists()
        else {}
    )
    for policy in options.policies:
        low, high = e2efly.load_policy(policy).contract.latency_range_s
        every = f"{1e3 * low:.0f} to {1e3 * high:.0f} ms"
        for weak, strong in STRENGTHS if "strengths" in options.parts else ():
            what = f"thrust {weak:g} to {strong:g} times the weight"
            rows += rows_of(of_strength(policy, weak, strong, options.vehicles), what, every)
        if "delays" in options.parts:
            asked[policy] = round(question(policy), 1)
            rows += rows_of(e2efly.evaluate(policy, options.vehicles, vehicle="any").flown, "unseen", every)
            for delay in DELAYS:
                env = {"action_latency": (delay, delay)}
                found = e2efly.evaluate(policy, options.vehicles, vehicle="any", env=env)
                rows += rows_of(found.flown, "unseen", f"{1e3 * delay:.0f} ms")
        for name in vehicle_names() if "named" in options.parts else ():
            rows += rows_of(e2efly.evaluate(policy, options.vehicles, vehicle=name).flown, name, "its own")
        others = WEIGHED.items() if "named" in options.parts else ()
        for name, factor in ((name, factor) for name, factors in others for factor in factors):
            with tempfile.TemporaryDirectory() as folder:
                file = weighed(name, factor, Path(folder))
                found = e2efly.evaluate(policy, options.vehicles, vehicle=file)
            rows += rows_of(found.flown, f"{name}, mass x{factor:g}", "its own")
        print(table(rows), flush=True)
    print(asked)
    whole = with_earlier("any_vehicle", options.json, "table", ("task", "vehicles", "delay"), rows)
    write("any_vehicle", options.json, {"table": whole, "question_us": asked})


if __name__ == "__main__":
    main()
