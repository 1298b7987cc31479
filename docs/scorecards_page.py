"""Make docs/benchmark.md from benchmarks/results/scorecards.json: `make docs`."""

import json
from pathlib import Path
from typing import Any

from e2efly.adapters.onnx_policy import FORMS, OPSETS
from e2efly.commands.benchmark import Benchmark
from e2efly.commands.terminal import markdown
from e2efly.environment.stress_rows import rows_for
from e2efly.validation.scorecard import LATENCIES, ON_PLANTS, SEED, TRAINED, UNTRAINED, VERSION
from e2efly.validation.stress_laws import LAWS

DOCS = Path(__file__).parent
RESULTS = DOCS.parent / "benchmarks" / "results" / "scorecards.json"
TASKS = ("hover", "land", "track", "race")
"""The order of the tasks in a table."""
VEHICLES = {
    "vis_r": ("VIS-R", ""),
    "crazyflie": (
        "Crazyflie",
        "Policies for any quadrotor that command rotors: RAPTOR's published checkpoint, and ours ([on a thousand "
        "vehicles](any-vehicle.md#beside-raptor)). RAPTOR was trained without delays. But for those of the latency, "
        "all rows fly with the 20 ms of the vehicle file. -: not measured.",
    ),
}
"""The tables in their order, by the vehicle that flies: its name, and what is compared."""
HEAD = f"""# Score a policy

    e2efly benchmark hover                            # a policy of the zoo
    e2efly benchmark runs/hover-bptt-0 hover          # two, side by side
    e2efly benchmark hover --baseline geometric       # a hover controller in its place, under its contract
    e2efly benchmark theirs.onnx                      # of another program, with theirs.contract.json beside it
    e2efly benchmark any/hover --vehicle crazyflie    # a policy of a family, on one vehicle
    e2efly benchmark hover --plants mujoco betaflight # through the real firmware, too

The command writes a card, `card.md` and `card.json`, into `runs/benchmark-NAME`. `e2efly bench` is another command: it
measures how fast this machine simulates.

## What is scored
Success by the task's own verdict, of the worst criterion, with 95 % intervals by Wilson. A policy is judged by its file
alone, in the preset of its task: the options of its training do not count.

| part | where | rows | starts a row |
| --- | --- | --- | --- |
| latency | training simulator | {", ".join(f"{1e3 * late:.0f}" for late in LATENCIES)} ms from observation to command \
| {Benchmark.episodes} |
| trained | training simulator | the {len(rows_for(()))} rows of [the stress](robustness.md#stress) that trainings \
draw from; more with cameras | {Benchmark.episodes} |
| untrained | training simulator | {len(LAWS)} rows from laws that no training draws from | {Benchmark.episodes} |
| trained | each of `--plants` | {", ".join(ON_PLANTS[TRAINED])} | {Benchmark.flights} |
| untrained | each of `--plants` | {", ".join(ON_PLANTS[UNTRAINED])} | {Benchmark.flights} |

The mean of several rows has the interval of as many starts as one row has, because all rows have the same starts. The
card names the rows that a plant cannot reproduce. A plant that does not fly a policy at all, as none flies one that
commands rotors, says so on the card.

**Seeds.** All starts and draws are of seed {SEED}, version {VERSION} of the benchmark; the card records both. No option
changes the seed. No default of another command and no other published figure has it, and the starts are of the stream
of `eval`, from which no training draws. Do not tune on them: for that, there is `e2efly eval --stress --seed`.

**Scale.** `--episodes` and `--flights` say how much is flown. The card is written after each part. The same command
goes on where an interrupted one was, and flies again only what has another scale, policy, vehicle or version of e2efly.

## A policy of Stable-Baselines3
Its own file cannot be read without running the code in it. Export the model by `e2efly.export(model, "policy.onnx")`,
then score that file. `export` writes the contract from the environment of the model ([other frameworks](adapters.md)).

## A policy of another program
Put a contract beside its ONNX file: `theirs.contract.json` beside `theirs.onnx`.

```json
"""
EXAMPLE = """{
  "task": "hover",
  "vehicle": "vis_r",
  "control_rate_hz": 50,
  "latency_range_s": [0.0, 0.04],
  "past_actions": 1,
  "observation": [
    {"field": "position_error", "frame": "body", "scale": -1},
    {"field": "attitude", "form": "matrix"},
    {"field": "velocity", "frame": "body"},
    {"field": "body_rate"},
    {"field": "past_actions"}
  ],
  "action": {"mode": "ctbr", "low": [0, -6, -6, -3], "high": [25, 6, 6, 3], "limits": [-1, 1], "order": [0, 1, 2, 3]}
}
"""
FIELDS = f"""```

| key | |
| --- | --- |
| `task`, `vehicle` | a task that is flown by state, and a vehicle or its .toml file |
| `control_rate_hz` | the rate at which the network is called |
| `latency_range_s` | the latencies of its training; if left out, the vehicle's own. The policy flies with the \
vehicle's, or with their mean if that is not among them |
| `past_actions` | how many of its own last outputs it sees, newest first; if left out, 0 |
| `observation` | what it sees, in its order. `field`: a field of the task or `attitude`, `velocity`, `body_rate`, \
`past_actions`, in the [units and frames](conventions.md) of e2efly. `frame`: `world`, or `body` for vectors that it \
sees in the body frame. `form` of the attitude: {", ".join(f"`{form}`" for form in FORMS)}; matrices are from body to \
world. `scale`: a factor on the numbers |
| `action` | `mode`: a command mode of `e2efly list rest`. `low` and `high`: the commands at the two `limits` of its \
output (if left out, -1 and 1). `order`: for each number of the mode's command, its place in the output |

The network has one input, (1, k) or (n, k), one output of four numbers, and no memory. Its operators are of version
{OPSETS[0]} to {OPSETS[-1]}, and those that a policy of e2efly may hold: linear layers with the usual activations. What
does not fit is refused by name. The benchmark writes it as a policy.onnx of e2efly into the folder of the card, where
`e2efly eval`, `validate` and `fly` take it, too.

## Scores
"""
AFTER = """
Percent of success, with its 95 % interval; behind it the row with the lowest success. *95 % at*: the latencies with
which at least 95 % succeed. A hover controller flies under the contract of the zoo's policy, at its rate. It is told
the latency of that contract, also where another one is flown. Success does not measure speed: the controllers race at
3 m/s, the policy as fast as it can. The error and the crashes of each row stand in `card.json` and `card.md`.
"""


def page() -> str:
    """The page."""
    found: dict[str, Any] = json.loads(RESULTS.read_text(encoding="utf-8"))
    lines = [
        HEAD + EXAMPLE + FIELDS.rstrip(),
        f"{found['episodes']} starts a row and {found['flights']} on MuJoCo, by `benchmarks/scorecards.py`, e2efly "
        f"{found['machine']['e2efly']}.",
    ]
    for vehicle, (name, about) in VEHICLES.items():
        rows = [row for row in found["table"] if row["vehicle"] == vehicle]
        rows.sort(key=lambda row: (TASKS.index(row["task"]), row["policy"] != row["task"]))
        measured = sorted({f"{card['date']}, {card['cpu']}" for card in found["cards"] if card["vehicle"] == vehicle})
        rows = [_shown(row, found["cards"]) for row in rows]
        columns = {column: "-" for row in rows for column in row}
        lines += ["", f"### {name}", "", *([about, ""] if about else []), *markdown([columns | row for row in rows])]
        lines += ["", f"Measured {'; '.join(measured)}."]
    return "\n".join([*lines, AFTER])


def _shown(row: dict[str, str], cards: list[dict[str, Any]]) -> dict[str, str]:
    """A row without its vehicle, and with the success at no delay."""
    (card,) = (card for card in cards if all(card[key] == row[key] for key in ("policy", "task", "vehicle")))
    at_once = {"0 ms": f"{100 * card['rows']['latency rows, training']['0 ms']:.1f}"}
    return {"policy": row["policy"], "task": row["task"]} | at_once | {
        key: value for key, value in row.items() if key != "vehicle"
    }  # fmt: skip


if __name__ == "__main__":
    (DOCS / "benchmark.md").write_text(page(), encoding="utf-8")
