"""The page on own plants is enough: examples/09_own_physics.py, made from it, flies as the training simulator does."""

import ast
import re
import sys
from pathlib import Path

import numpy as np
import pytest

import e2efly
from e2efly.courses.gates import Gates
from e2efly.courses.tracks import load_track
from e2efly.policy.goal import Shape
from e2efly.tasks.track.goal import TrackRoute
from e2efly.validation.plant import Plant, RigidState
from e2efly.validation.plants import find_plant

ROOT = Path(__file__).parents[2]
EXAMPLE = ROOT / "examples" / "09_own_physics.py"
PAGE = (ROOT / "docs" / "own-plant.md").read_text(encoding="utf-8")
CITED = sorted(set(re.findall(r"`([a-z_/]+\.py):([A-Za-z_.]+)`", PAGE)))
SHAPE = Shape(0.05, 0.12)
VEHICLE = e2efly.load_vehicle("vis_r")
START = RigidState(
    np.array([1.0, -2.0, 3.0]), np.array([2.0, -1.0, 0.5]), np.array([0.9, 0.3, -0.3, 0.1]) / np.linalg.norm(
        [0.9, 0.3, -0.3, 0.1]
    ), np.array([3.0, -2.0, 1.0]),
)  # fmt: skip


def own() -> type[Plant]:
    return find_plant(f"{EXAMPLE}:Quadrotor")


def flown(plant: Plant, commands: np.ndarray) -> np.ndarray:
    """(t, 13) the states after each command, held for a control period each."""
    plant.reset(START)
    states = []
    for command in commands:
        plant.step(command, 1 / 30)
        s = plant.state
        states.append(np.concatenate([s.position, s.velocity, s.quaternion, s.body_rate]))
    return np.array(states)


@pytest.mark.parametrize("seed", range(5))
def test_under_commands_that_saturate_the_mixer_it_is_the_training_simulator(seed: int) -> None:
    random = np.random.default_rng(seed)
    commands = random.uniform([0, -10, -10, -4], [27, 10, 10, 4], (30, 4))
    here = flown(own()(VEHICLE, "ctbr"), commands)  # type: ignore[call-arg]
    there = flown(find_plant("simulator")(VEHICLE, "ctbr"), commands)  # type: ignore[call-arg]
    assert np.ptp(there[:, 10]) > 5
    off = np.abs(here - there).max(axis=0)
    assert off[:3].max() < 1e-3 and off[3:6].max() < 3e-3 and off[6:10].max() < 1e-3 and off[10:].max() < 0.01


@pytest.mark.whole
def test_the_zoos_hover_does_there_what_eval_says() -> None:
    n = 200
    success, error = sys.modules[own().__module__].hover(e2efly.load_policy("hover"), n)
    theirs = e2efly.evaluate("hover", episodes=n).flown["hover"]
    noise = 4 * np.hypot(np.std(error), np.std(theirs.final_error)) / np.sqrt(n)
    assert abs(np.mean(success) - np.mean(theirs.success)) <= 0.015
    assert abs(np.mean(error) - np.mean(theirs.final_error)) < noise < 1e-3


def test_the_references_are_the_formulas_of_the_page() -> None:
    t, phase = np.linspace(0, 10, 501), 0.7
    w = 0.2 * np.pi * t + phase
    circle = np.stack([2 * np.cos(w), 2 * np.sin(w), 3 + 0 * w], axis=-1)
    w = 3 / (2 * np.sqrt(2)) * t + phase
    eight = np.stack([2 * np.sin(w), np.sin(2 * w), 3 + 0 * w], axis=-1)
    for name, points in (("circle", circle), ("lemniscate", eight)):
        own = {"circle": {"circle_rate": 0.2 * np.pi}, "lemniscate": {"lemniscate_speed": 3.0}}[name]
        goal = TrackRoute(reference=name, centre=(0.0, 0.0, 3.0), radius=2.0, phase=phase, **own).course(SHAPE, 1 / 30)
        flown = np.stack([goal.goal.goal(goal.memory, np.array([at]))[0] for at in t])
        assert np.abs(flown - points).max() < 1e-4


def test_a_gate_is_judged_by_the_formulas_of_the_page() -> None:
    track = load_track("four_gates")
    assert track.position.tolist() == [[4, 4, 1], [8, 0, 2], [5, -4, 1], [-1, -1, 1]]
    assert np.degrees(track.yaw).round(6).tolist() == [0, -86, -167, 99]
    random, gates, r = np.random.default_rng(0), Gates.of(track), 0.12
    n = 20_000
    before = track.position[0] + random.uniform([-0.4, -1.2, -0.9], [0.4, 1.2, 1.2], (n, 3))
    after = before + random.uniform(-0.5, 0.5, (n, 3))
    x, y, z = np.moveaxis(np.stack([before, after]) - track.position[0], -1, 0)  # its yaw is 0
    crossed = (x[0] < 0) != (x[1] < 0)
    share = np.where(crossed, x[0] / np.where(x[0] == x[1], 1, x[0] - x[1]), 0)
    at = np.abs(np.stack([y[0] + share * (y[1] - y[0]), z[0] + share * (z[1] - z[0])]))
    inside, outside = (at < 0.5 - r).all(0), (at > 0.6 + r).any(0)
    forward = crossed & (x[0] < 0)
    passed, missed, struck = gates.judge(np.zeros(n, int), before, after, r)
    assert passed.sum() > 100 and (missed & ~struck).sum() > 100 and (struck & ~missed).sum() > 100
    assert (passed == forward & inside).all()
    assert (missed == forward & ~inside).all()
    assert (struck == crossed & ~inside & ~outside).all()


@pytest.mark.parametrize(("file", "name"), CITED, ids=lambda part: part)
def test_what_the_page_cites_is_there(file: str, name: str) -> None:
    scope = ast.parse((ROOT / "src" / "e2efly" / file).read_text(encoding="utf-8")).body
    for part in name.split("."):
        found = [n for n in scope if getattr(n, "name", None) == part or part in _assigned(n)]
        assert found, f"{file} has no {name}"
        scope = getattr(found[0], "body", [])


def _assigned(node: ast.stmt) -> list[str]:
    targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", None)]
    names = [t.elts if isinstance(t, ast.Tuple) else [t] for t in targets]
    return [t.id for group in names for t in group if isinstance(t, ast.Name)]


def test_the_page_cites_its_sources() -> None:
    assert len(CITED) > 20
