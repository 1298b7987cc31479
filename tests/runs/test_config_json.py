"""A run's config.json, as people edit it and as disks damage it."""

import copy
import json
from pathlib import Path
from typing import Any

import pytest

from e2efly.commands.cli import run
from e2efly.config import ALGORITHMS
from e2efly.runs import presets
from e2efly.runs.inputs import from_json, to_json
from e2efly.tasks import TASKS

GOOD = json.loads(json.dumps(to_json(presets.preset("avoid", "ppo"))))


def changed(path: str, value: Any) -> Any:
    """The configuration with another value at a dotted path; None: all of it."""
    found = where = copy.deepcopy(GOOD)
    *folders, last = [int(name) if name.isdigit() else name for name in path.split(".")]
    for name in folders:
        where = where[name]
    where[last] = value
    return found


@pytest.mark.parametrize(
    ("path", "value", "said"),
    [
        ("steps", None, "steps is None; accepted: a whole number"),
        ("steps", "many", "steps is 'many'; accepted: a whole number"),
        ("steps", 0.5, "steps is 0.5; accepted: a whole number"),
        ("steps", 1e12, "steps is 1000000000000.0; accepted: a whole number"),
        ("steps", 10**400, "accepted: a whole number"),
        ("steps", True, "steps is True; accepted: a whole number"),
        ("task", None, "task is None; accepted: an object with altitude, ceiling, collisions_end"),
        ("task.forest.density", [0.1], "task: forest: density is [0.1]; accepted: a number"),
        ("task.speed", [1.0], "task: speed is [1.0]; accepted: a list of 2: a number, a number"),
        ("task.collisions_end", 1, "task: collisions_end is 1; accepted: true or false"),
        ("env.vehicle", 3, "env: vehicle is 3; accepted: a text"),
        ("env.control_rate", "fast", "env: control_rate is 'fast'; accepted: a number or null"),
        ("env.cameras", {}, "env: cameras is {}; accepted: a list, of an object with angle_spread, "),
        ("env.cameras.0.sees", "all", "env: cameras[0]: sees is 'all'; accepted: 'depth', 'range', "),
        ("network.hidden", [64, None], "network: hidden[1] is None; accepted: a whole number"),
        ("reward.weights", ["near"], "reward: weights is ['near']; accepted: an object, with a number each"),
        ("reward.weights.vel", "1", "reward: weights.vel is '1'; accepted: a number"),
        ("curriculum.0.changes", None, "curriculum[0]: changes is None; accepted: an object, with a number or"),
        ("task_name", ["avoid"], "task_name is ['avoid']; accepted: avoid, avoid_together, dodge, gap, hall, hover"),
        ("algo_name", None, "algo_name is None; accepted: ppo, bptt"),
    ],
)
def test_a_value_of_another_type_is_named(path: str, value: Any, said: str) -> None:
    with pytest.raises(ValueError) as error:
        from_json(changed(path, value), "config.json")
    assert said in str(error.value)
    assert str(error.value).startswith("config.json: ")


@pytest.mark.parametrize("task", TASKS)
def test_every_configuration_is_read_as_it_was(task: str) -> None:
    for algo in ALGORITHMS:
        config = presets.preset(task, algo)
        assert from_json(json.loads(json.dumps(to_json(config))), "here") == config


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[" * 100_000, "config.json cannot be read: it is nested too deeply"),
        ("[]", "config.json is []; accepted: an object"),
        ("null", "config.json is None; accepted: an object"),
        ("{}", "config.json: missing key 'algo_name', 'task_name'"),
        ("", "config.json cannot be read: Expecting value"),
        (json.dumps(changed("steps", [[[[[[[[[0]]]]]]]]])), "steps is [[[[[[[...]]]]]]]; accepted: a whole number"),
    ],
)
def test_what_is_no_configuration_is_named(
    text: str, said: str, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    (tmp_path / "config.json").write_text(text)
    assert run(["export", str(tmp_path)]) == 2
    assert said in capsys.readouterr().err
