import dataclasses
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from matplotlib.image import imread

from e2efly.config import RewardConfig
from e2efly.config.drawing import Face, Line, Mark
from e2efly.environment import Env, random_key
from e2efly.environment.episodes import Act, Episodes, wilson
from e2efly.tasks import TASKS
from e2efly.viewing import plots, style
from e2efly.viewing.flights import Flights, fly
from e2efly.viewing.objects import scene

STEPS, PERIOD = 30, 1 / 30
SUITES = {name: suite for task in TASKS.values() for name, suite in task.training().criteria().items()}


def flights(n: int = 3, success: bool = True, seed: int = 0) -> Flights:
    """Circles about the origin at 2 m, the first one the shortest; what lies after an end is not a number."""
    time = PERIOD * np.arange(1, STEPS + 1)
    angle = time[:, None] + np.arange(n)
    rng = np.random.default_rng(seed)
    zero = np.zeros_like(angle)
    position = np.stack([np.cos(angle), np.sin(angle), 2 + zero], axis=-1)
    length = np.minimum(10 + 10 * np.arange(n), STEPS)
    position[np.arange(STEPS)[:, None] >= length] = np.nan
    return Flights(
        time=time,
        position=position,
        velocity=np.stack([-np.sin(angle), np.cos(angle), zero], axis=-1),
        quaternion=np.stack([np.cos(angle / 2), zero, zero, np.sin(angle / 2)], axis=-1),
        body_rate=rng.normal(size=(STEPS, n, 3)),
        rotor_speed=rng.uniform(1000, 3000, (STEPS, n, 4)),
        command=rng.normal(size=(STEPS, n, 4)),
        goal=np.stack([np.cos(angle), np.sin(angle), 2.1 + zero], axis=-1),
        length=length,
        success=np.full(n, success),
    )


def episodes(n: int = 50, success: float = 0.9, scale: float = 1.0) -> Episodes:
    rng = np.random.default_rng(n)
    values = {f.name: scale * rng.uniform(0.1, 1.0, n) for f in dataclasses.fields(Episodes)}
    ok = np.arange(n) < success * n
    return Episodes(**{**values, "success": ok, "crashed": ~ok})


def rows(count: int, chunk: int = 5) -> list[dict[str, float]]:
    """What `RunDirectory.rows` reads: evaluations and seconds in a chunk's last row only."""
    table = []
    for i in range(1, count + 1):
        row = {"update": float(i), "steps": 1000.0 * i, "reward": float(np.tanh(i)), "reward/prog2": -1.0 / i}
        row |= {"reward/crash": 0.0, "loss/policy": 0.1}
        if i % chunk == 0:
            row |= {"seconds": 10.0 + i, "eval/circle/success": 0.5, "eval/lemniscate/success": 1.0}
        table.append(row)
    return table


def check_png(path: Path, height: tuple[int, int] = (500, 1300)) -> None:
    """A PNG of a README's width that is neither blank nor all ink."""
    assert path.read_bytes().startswith(b"\x89PNG\r\n\x1a\n")
    image = imread(path)
    assert image.shape[1] == 1200
    assert height[0] <= image.shape[0] <= height[1]
    assert 0.005 < np.mean(image[..., :3].min(axis=-1) < 0.9) < 0.6


@pytest.mark.parametrize("count", [0, 1, 5, 60])
def test_learning_of_any_number_of_rows(tmp_path: Path, count: int) -> None:
    plots.plot_learning(rows(count), tmp_path / "learning.png", r"a $\name{$", best_update=5)
    check_png(tmp_path / "learning.png")


def test_a_logarithmic_axis_is_labelled_without_formulas(tmp_path: Path) -> None:
    with style.figure(tmp_path / "a.png", "title", 3.0) as figure:
        axes = figure.add_subplot()
        axes.plot([1, 2], [0.02, 30.0])
        axes.set_yscale("log")
    labels = [label.get_text() for axis in (axes.xaxis, axes.yaxis) for label in axis.get_ticklabels(which="both")]
    assert {"0.1", "1", "10"} <= set(labels)
    assert "$" not in "".join(labels)


def test_learning_without_a_single_reward_term(tmp_path: Path) -> None:
    plots.plot_learning([{"update": 1.0, "steps": 10.0, "seconds": 3.0}], tmp_path / "a.png", "hover", best_update=1)
    check_png(tmp_path / "a.png")


@pytest.mark.whole(but=1)
@pytest.mark.parametrize("name", list(SUITES))
def test_flights_of_every_task(tmp_path: Path, name: str) -> None:
    plots.plot_flights(SUITES[name], flights(), tmp_path / "flights.png", name)
    check_png(tmp_path / "flights.png")


def test_flights_that_all_failed_at_once(tmp_path: Path) -> None:
    failed = dataclasses.replace(flights(success=False), length=np.ones(3, int))
    plots.plot_flights(SUITES["race"], failed, tmp_path / "flights.png", "race")
    plots.plot_time(failed, 0, tmp_path / "time.png", "race")
    check_png(tmp_path / "flights.png")
    check_png(tmp_path / "time.png")


@pytest.mark.parametrize("mode", ["ctbr", "rotor_thrust", "velocity"])
def test_time_of_command_modes(tmp_path: Path, mode: str) -> None:
    plots.plot_time(dataclasses.replace(flights(), command_mode=mode), 1, tmp_path / "time.png", mode)
    check_png(tmp_path / "time.png")


def test_errors_of_several_criteria_with_limits(tmp_path: Path) -> None:
    flown = {"circle": episodes(), "lemniscate": episodes(40, scale=30.0)}
    plots.plot_errors(flown, tmp_path / "errors.png", "track", plots.limits(SUITES))
    check_png(tmp_path / "errors.png")


@pytest.mark.parametrize(("n", "scale"), [(0, 1.0), (1, 1.0), (20, 0.0)])
def test_errors_of_few_alike_or_failed_episodes(tmp_path: Path, n: int, scale: float) -> None:
    plots.plot_errors({"hover": episodes(n, 0.0, scale)}, tmp_path / "errors.png", "hover")
    check_png(tmp_path / "errors.png")


def test_limits_are_those_of_the_tasks() -> None:
    assert plots.limits(SUITES) == {
        "hover": {"final_error": 0.1},
        "land": {"final_error": 0.1},
        "circle": {"mean_error": 0.08},
        "lemniscate": {"mean_error": 0.15},
        "swap": {"final_error": 0.2},
        "hover_payload": {"final_error": 0.1},
    }


def test_scene_of_a_race_has_every_gate_where_it_stands() -> None:
    things = scene(SUITES["race"], flights())
    assert [thing.text for thing in things if isinstance(thing, Mark)] == ["1", "2", "3", "4"]
    bars = [thing.points for thing in things if isinstance(thing, Face)]
    assert len(bars) == 16
    first = np.concatenate(bars[:4])  # four_gates: at (4, 4, 1), opening 1 m, flown through along x
    np.testing.assert_allclose(first.mean(axis=0), [4, 4, 1], atol=1e-6)
    np.testing.assert_allclose(first.min(axis=0), [4, 3.4, 0.4], atol=1e-6)
    np.testing.assert_allclose(first.max(axis=0), [4, 4.6, 1.6], atol=1e-6)


def test_scene_of_tracking_ends_with_each_flight() -> None:
    lines = [thing for thing in scene(SUITES["circle"], flights()) if isinstance(thing, Line)]
    assert [len(line.points) for line in lines] == [10, 20, 30]


def test_tilt_and_yaw_by_hand() -> None:
    half = np.sqrt(0.5)
    turned = np.array([[1, 0, 0, 0], [half, 0, 0, half], [half, half, 0, 0], [0, 1, 0, 0]])
    f = flights(1)
    f.quaternion[:4, 0] = turned
    np.testing.assert_allclose(np.degrees(f.tilt[:4, 0]), [0, 0, 90, 180], atol=1e-6)
    np.testing.assert_allclose(np.degrees(f.yaw[:3, 0]), [0, 90, 0], atol=1e-6)


def test_fly_ends_each_episode_where_the_environment_does() -> None:
    suite = dataclasses.replace(SUITES["land"], episode_s=1.0)
    env = Env.of(suite, RewardConfig({"prog2": 1.0}))
    n = 4

    def fall(observation: jax.Array) -> jax.Array:
        return jnp.tile(jnp.array([-1.0, 0.0, 0.0, 0.0]), (observation.shape[0], 1))

    flown = fly(env, Act.of(fall), random_key(0), n, 40)
    assert flown.time[0] == pytest.approx(1 / 30)
    assert flown.position.shape == (40, n, 3)
    assert not flown.success.any()
    for i, k in enumerate(flown.length):
        assert k <= 30
        low = flown.position[:k, i, 2] <= env.task.shape.feet_height
        assert not low[:-1].any()
        assert low[-1] or k == 30
    np.testing.assert_allclose(flown.command[0, 0], [0.0, 0.0, 0.0, 0.0], atol=1e-6)
    np.testing.assert_allclose(flown.goal[5, 2], [0.0, 0.0, 0.05], atol=1e-6)
    assert flown.command_mode == "ctbr"


@pytest.mark.parametrize(
    ("successes", "n", "low", "high"),
    [
        (0, 0, 0.0, 1.0),
        (0, 10, 0.0, 3.8416 / 13.8416),  # all z^2 / (n + z^2)
        (10, 10, 10 / 13.8416, 1.0),
        (5, 10, 0.5 - 1.96 / 13.8416 * 3.4604**0.5, 0.5 + 1.96 / 13.8416 * 3.4604**0.5),
        (990, 1000, 0.98170, 0.99456),
    ],
)
def test_wilson_by_hand(successes: int, n: int, low: float, high: float) -> None:
    assert wilson(successes, n) == pytest.approx((low, high), abs=1e-5)


@pytest.mark.parametrize(("successes", "n"), [(-1, 5), (6, 5)])
def test_wilson_refuses_what_cannot_be_counted(successes: int, n: int) -> None:
    with pytest.raises(ValueError, match="accepted"):
        wilson(successes, n)
