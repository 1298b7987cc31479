"""Write docs/zoo.md, a card for each policy of the zoo, from what the package ships: `make docs`.

The pictures are those of docs/zoo_pictures.py.
"""

import dataclasses
from contextlib import redirect_stderr
from io import StringIO
from pathlib import Path
from typing import Any

from e2efly.commands.train import recorded
from e2efly.config import TrainConfig
from e2efly.config.changes import differing
from e2efly.config.env import FILE, STILL
from e2efly.config.storage import read_json
from e2efly.policy.loader import Policy, load_policy
from e2efly.policy.zoo import USUAL, config_file, contents, policy_file
from e2efly.runs import presets
from e2efly.runs.inputs import from_json
from e2efly.vehicles.family import load_family

DOCS = Path(__file__).parent
TASKS = {
    "hover": "Fly to a point and stay there.",
    "hover_rotors": "Fly to a point and stay there, by commands to each rotor ([any vehicle](any-vehicle.md)).",
    "land": "Land on a point of the ground, gently.",
    "track": "Follow a moving reference.",
    "race": "Fly a lap through gates.",
    "race_any": "Fly a lap of any track: a different one in every episode ([any track](any-track.md)).",
    "race_speed": "Fly a lap through gates at a commanded speed, in a room or outdoors.",
    "race_duel": "Race another, and touch neither it nor a gate ([how](many-vehicles.md#a-race-against-others)).",
    "swap": "Exchange places, eight in a world, and touch none ([how](many-vehicles.md)).",
    "race_eyes": "Fly a lap of one of four tracks by a camera and an IMU alone ([racing by eye](eyes.md)).",
    "race_told": "The teacher of `race_eyes`: fly a lap of the same tracks by poses, at about 9 m/s.",
    "gap": "Fly through a narrow tilted slit, banked.",
    "hover_aware": "Fly to a point and keep a moving ball in view.",
    "hover_payload": "Hold a load, which hangs on a cable and is not seen, at a place.",
    "dodge": "Hover, and dodge balls that are thrown at 8 m/s, which only a depth camera shows.",
    "land_visual": "Land on a pad that only a camera shows.",
    "avoid": "Fly fast through a forest that only a depth camera shows.",
    "hall": "Fly through a cluttered hall that only a LiDAR shows.",
    "race_clutter": "Race among obstacles that only a depth camera shows.",
    "race_clutter_room": "The same in a room of 6x6 m, at the speed of a room ([a small room](hil.md#a-small-room)).",
}
VEHICLES = {
    "any": "Any quadrotor",
    "crazyflie": "Crazyflie",
    "multirotor": "Any multirotor of four to eight rotors",
    "vis_h": "VIS-H",
    "vis_r": "VIS-R",
}
WORST = 3
"""Rows of the stress that a card names."""
UNTRAINED_ENOUGH = 0.95
"""Success from which on a row counts as met by a policy that was not trained for it."""
INTRO = """
# The zoo

Written by `make docs` from `src/e2efly/policy/zoo/zoo.json` and the policies beside it. These policies come with the
package. Every command that takes a policy takes one by the name of its card:

    e2efly eval vis_r/hover
    e2efly eval vis_r/hover --stress
    e2efly validate vis_r/hover --plant mujoco

`e2efly fly vis_r/hover --link ... --pose ...` flies it on a real vehicle: read [Hardware](hardware.md) first.

- **Success** is that of 1000 unseen starts of `e2efly eval`, with the vehicle of the file in still air; of *any
  quadrotor*, with 1000 random vehicles that the training did not draw. The [tasks](tasks.md) say what counts.
- **Under stress** the vehicle, the air or the sensors are not those of the file: one difference in each
  [row](robustness.md#stress), and a last row with all of them at once. Each row is of 250 starts.
  A card names the worst rows; [Benchmarks](benchmarks.md) has all of them. *Not in training* are rows
  from [laws](robustness.md#laws-that-no-training-draws-from) that no training draws from.
- **Pictures** show the first starts of `e2efly eval`: 12, or 6 where the policy sees. **Videos** show one of
  these flights, from a camera behind the vehicle. The blue ring is around the place where the policy is told to be.
- **Training curves** show the success of the evaluations on the way, as `TASK.curve.csv` beside the policy has it.
  Policies that were made before these files were kept have none. The command *trained by* makes such a run, with its
  curve in `plots/learning.png`; its result differs a little on another machine.
- **Configurations**: `TASK.config.json` beside the policy is the configuration of its training, and the command
  *trained by* gives exactly that. Where the preset differs by now, the card says so. The files of policies that are
  older than 2026-11-27 were made later, from the source of their day and the steps of their run; each gives the
  contract that its policy has.

None of these policies has flown a real vehicle yet. All of them were flown in the simulator of the training, and
many in MuJoCo and through the real firmware ([Validate](validation.md)).
"""


def percent(share: float) -> str:
    """With one decimal, cut: 100.0 stands for all."""
    return f"{int(1000 * share + 1e-6) / 10:.1f} %"


def limits(about: dict[str, Any], kind: str = "stress", called: str = "under stress") -> list[str]:
    """The worst rows of a kind of the stress, each a line of the table."""
    rows = {name: share for name, share in about.get(kind, {}).items() if name not in ("nominal", "all at once")}
    worst = sorted(rows.items(), key=lambda row: row[1])[:WORST]
    return [f"| {called}: {name} | {percent(share)} |" for name, share in worst if share < 1.0]


def flies_by(policy: Policy) -> str:
    """What a policy needs beside its cameras, in words."""
    contract = policy.contract
    memory = f"a memory of {contract.memory_size} numbers" if contract.memory_size else "no memory"
    return f"{contract.control_rate_hz:g} commands per second, {memory}"


def configured(policy: Path) -> TrainConfig:
    """The configuration by which a policy was trained, on any number of devices."""
    file = config_file(policy)
    return presets.begun(dataclasses.replace(from_json(read_json(file), str(file)), devices=None))


def option(name: str, value: Any) -> str:
    """A value as an option of the command line."""
    if (name, value) == ("curriculum", ()):
        return " --no-curriculum"
    return f" --{name.replace('_', '-')} {' '.join(map(str, value)) if isinstance(value, tuple) else value}"


def made_by(command: str, config: TrainConfig) -> str:
    """How a configuration is trained today: the command, with the options in which the preset differs by now. Where
    options cannot say it, how the two differ.
    """
    others = differing(config, recorded(command).config)
    now = ", ".join(f"{name} {today}" for name, (_, today) in others.items())
    options = "".join(option(name, value) for name, (value, _) in others.items())
    try:
        with redirect_stderr(StringIO()):
            same = recorded(command + options).config == config
    except (ValueError, SystemExit):  # not everything is an option
        same = False
    if same:
        return f"`e2efly {command}{options}`" + (f" (today's preset has {now})" if others else "")
    its = ", ".join(f"{name} {value}" for name, (value, _) in others.items())
    return f"no command of today: it had {its}, where `e2efly {command}` has {now}"


def card(vehicle: str, task: str, about: dict[str, Any]) -> list[str]:
    """The lines of one policy's card."""
    name = f"{vehicle}/{task}"
    policy = policy_file(name)
    config = configured(policy)
    kind = config.task.name
    options = "" if vehicle == USUAL else f" --vehicle {vehicle}"
    options += "" if about["algorithm"] == config.task.best else f" --algo {about['algorithm']}"
    preset = "" if about["preset"] == "robust" else f" --preset {about['preset']}"
    stress = about.get("stress", {})
    lines = [f"### {name}", "", TASKS[task]]
    for kind_of, ending in (("Flights", ".png"), ("One flight", ".webp"), ("Training", "-training.png")):
        if (DOCS / "zoo" / f"{vehicle}-{task}{ending}").exists():
            lines += ["", f"![{kind_of} of {name}](zoo/{vehicle}-{task}{ending})"]
    lines += ["", f"| {name} | |", "| --- | --- |"]
    for criterion, share in about["success"].items():
        which = "" if criterion in (task, kind) else f": {criterion}"
        lines.append(f"| success, {STILL if load_family(vehicle) else FILE}{which} | {percent(share)} |")
    if "mean_speed_m_s" in about:
        speeds = about["mean_speed_m_s"]
        told = ", ".join(f"{c} {v:.1f}" for c, v in speeds.items()) if isinstance(speeds, dict) else f"{speeds:.1f}"
        lines.append(f"| mean speed of a success, m/s | {told} |")
    if stress:
        lines.append(f"| under stress: all at once | {percent(stress['all at once'])} |")
        lines += limits(about) or ["| under stress: every other row | 100.0 % |"]
    else:
        lines.append("| under stress | not measured row by row |")
    if laws := about.get("untrained"):
        many = sum(share >= UNTRAINED_ENOUGH for share in laws.values())
        lines.append(f"| not in training: rows at {percent(UNTRAINED_ENOUGH)} or more | {many} of {len(laws)} |")
        lines += limits(about, "untrained", "not in training")
    lines.append(f"| flies by | {flies_by(load_policy(policy))} |")
    lines += [f"| camera {image.name} | {image.mount} |" for image in load_policy(policy).contract.images]
    if courses := load_policy(policy).contract.courses:
        lines.append(f"| trained for | {', '.join(map(str, courses))} |")
    trained = made_by(f"train {kind}{options}{preset} --seed {about['seed']}", config)
    lines.append(f"| trained by | {trained}, {about['env_steps'] / 1e6:.1f} million steps |")
    lines.append(f"| file | {policy.stat().st_size / 1000:.0f} kB, SHA-256 `{about['sha256'][:16]}...` |")
    return [*lines, ""]


def page() -> str:
    """The whole page."""
    zoo, lines = contents(), [INTRO.strip(), ""]
    for vehicle in sorted(zoo, key=lambda name: (name != USUAL, load_family(name) is None, name)):
        lines += [f"## {VEHICLES[vehicle]}", ""]
        for task in [task for task in TASKS if task in zoo[vehicle]]:
            lines += card(vehicle, task, zoo[vehicle][task])
    return "\n".join(lines)


if __name__ == "__main__":
    (DOCS / "zoo.md").write_text(page(), encoding="utf-8")
