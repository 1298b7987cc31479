"""The presets `paper` and `authors`: the paper's tables, and a source for each number that is not the paper's."""

import dataclasses
import json
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest

from e2efly.config import Sourced, TrainConfig
from e2efly.config.changes import differing
from e2efly.environment import Env
from e2efly.policy.goal import Shape
from e2efly.runs import presets
from e2efly.runs.inputs import fingerprint, to_json
from e2efly.runs.paper import AUTHORS, SILENT
from e2efly.tasks import TASKS
from e2efly.tasks.task import make_task

RESULTS = Path(__file__).parents[2] / "benchmarks" / "results"
HAVING = [name for name, task in TASKS.items() if task.paper is not None]
SIZES = {"hover": 13, "land": 13, "track": 40, "race": 16, "land_visual": 13, "race_clutter": 17}
"""Numbers of the paper's observations, images not counted."""


def values(config: TrainConfig) -> dict[str, str]:
    """The configuration by dotted name."""
    told = {}
    for name, value in to_json(config).items():
        told |= {f"{name}.{k}": v for k, v in value.items()} if isinstance(value, dict) else {name: value}
    told |= {f"reward.weights.{k}": v for k, v in told.pop("reward.weights").items()}
    return {name: json.dumps(value, sort_keys=True) for name, value in told.items()}


@pytest.mark.parametrize("task", HAVING)
@pytest.mark.parametrize("algo", ["ppo", "bptt"])
def test_what_the_presets_differ_in_has_a_source(task: str, algo: str) -> None:
    of = TASKS[task].paper
    assert of is not None
    ours, theirs = (presets.preset(task, algo, name) for name in ("paper", "authors"))
    given = [one for one in (*AUTHORS, *of.authors) if one.algo in ("", algo)]
    before, after = values(ours), values(theirs)
    changed = {name for name in before | after if before.get(name) != after.get(name)}
    assert changed <= {one.field for one in given}
    last: dict[str, Sourced] = {one.field: one for one in (*SILENT, *of.silent, *given) if one.algo in ("", algo)}
    for name, one in last.items():
        assert len(one.source) > 10
        assert after.get(name, "0.0") == json.dumps(json.loads(json.dumps(one.value, default=dataclasses.asdict)),
                                                    sort_keys=True), name  # fmt: skip


@pytest.mark.parametrize("task", HAVING)
def test_the_preset_paper_keeps_the_weights_of_its_tables(task: str) -> None:
    of = TASKS[task].paper
    assert of is not None
    weights = presets.preset(task, "bptt", "paper").reward.weights
    assert {name: weights[name] for name in of.weights} == of.weights
    added = {one.field.removeprefix("reward.weights.") for one in of.silent}
    assert weights.keys() - of.weights.keys() <= added


@pytest.mark.parametrize(("task", "size"), SIZES.items())
@pytest.mark.parametrize("name", ["paper", "authors"])
def test_observations_have_the_papers_sizes(task: str, size: int, name: str) -> None:
    config = presets.preset(task, "ppo", name)
    assert Env.of(config.task, config.reward, config.env).observation_size == size


def test_authors_starts_are_as_near_as_theirs() -> None:
    ours, theirs = (presets.preset("hover", "ppo", name).task for name in ("paper", "authors"))
    assert differing(ours, theirs).keys() == {
        "episode_s", "target", "position", "velocity", "tilt", "body_rate"
    }  # fmt: skip


@pytest.mark.parametrize(("must_touch", "success"), [(True, False), (False, True)])
def test_landing_as_the_authors_count_it_needs_no_touch(must_touch: bool, success: bool) -> None:
    config = dataclasses.replace(presets.preset("land", "ppo", "authors").task, must_touch=must_touch)
    task = make_task(config, Shape(0.05, 0.12), 0.03)
    state, memory = task.start(jnp.zeros(2, jnp.uint32), 1)
    near = dataclasses.replace(state, position=jnp.array([[0.1, 0.1, 0.2]]), velocity=jnp.zeros((1, 3)))
    _, outcome = task.advance(memory, near, near, jnp.ones(1), jnp.zeros(1, bool))
    assert bool(outcome.success[0]) is success
    assert bool(outcome.terminated[0]) is success


def test_tracking_pays_for_its_goal_where_the_time_is_over() -> None:
    config = presets.preset("track", "ppo", "authors").task
    task = make_task(config, Shape(0.05, 0.12), 0.03)
    state, memory = task.start(jnp.zeros(2, jnp.uint32), 1)
    on_it = dataclasses.replace(state, position=task.goal(memory, jnp.full(1, 5.0)))
    for over in (False, True):
        _, outcome = task.advance(memory, on_it, on_it, jnp.full(1, 5.0), jnp.full(1, over))
        assert bool(outcome.arrived[0]) is over
    np.testing.assert_allclose(outcome.error, 0.0, atol=1e-6)


def test_a_fingerprint_leaves_out_an_added_field_only_while_it_says_what_was_done_before() -> None:
    config = dataclasses.replace(presets.preset("land", "ppo"), stop_at=0.99)
    recorded = json.loads((RESULTS / "time_to_criterion.json").read_text())["runs"]
    known = {run["configuration"] for run in recorded if run["command"].startswith("train land --algo ppo")}
    assert fingerprint(config) in known
    for task, algo in (({"must_touch": False}, {}), ({}, {"decay": "linear"})):
        other = dataclasses.replace(
            config, task=dataclasses.replace(config.task, **task), algo=dataclasses.replace(config.algo, **algo)
        )
        assert fingerprint(other) not in known
