"""Programs shared among devices, and the cache of what was traced."""

import dataclasses
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from e2efly.config import NetworkConfig, TrainConfig
from e2efly.environment import Env, random_key
from e2efly.environment.episodes import Act, run_episodes
from e2efly.learning.devices import OWN, SAME, on_each, share
from e2efly.learning.programs import Programs, _chunk, _evaluate, start_program
from e2efly.learning.setup import Setup
from e2efly.runs import presets
from e2efly.tasks import TASKS

pytestmark = pytest.mark.usefixtures("quick")


def config(**changes: Any) -> TrainConfig:
    base = presets.preset("land", "bptt")
    algo = dataclasses.replace(base.algo, envs=8, horizon=8)
    task = dataclasses.replace(base.task, episode_s=1.0)
    network = NetworkConfig((8,))
    return dataclasses.replace(
        base, algo=algo, task=task, network=network, chunk=2, eval_episodes=9, devices=2, **changes
    )


def small_ppo(**changes: Any) -> TrainConfig:
    """Of programs that are compiled soon."""
    base = presets.preset("hover", "ppo")
    algo = dataclasses.replace(base.algo, envs=8, horizon=4, minibatch=16, epochs=1)
    task = dataclasses.replace(base.task, episode_s=1.0)
    network = NetworkConfig((8,))
    return dataclasses.replace(
        base, algo=algo, task=task, network=network, chunk=2, eval_episodes=9, devices=2, **changes
    )


def run(setup: Setup, traced: Path | None) -> tuple[Any, Any]:
    parameters = setup.algorithm.init(setup.env, setup.config.algo, 0)
    programs = Programs.compile(setup, parameters, traced)
    state = programs.begin(setup.env, parameters, random_key(0))
    state, metrics = programs.chunk(setup.env, setup.config.algo, state, 0, 4)
    judge = next(iter(setup.judges.values()))
    flown = programs.evaluate(judge, jax.tree.map(lambda x: np.asarray(x)[0], state.parameters.policy), random_key(1))
    return jax.tree.map(np.asarray, metrics), jax.tree.map(np.asarray, flown)


def same(a: Any, b: Any) -> bool:
    return all(np.array_equal(x, y) for x, y in zip(jax.tree.leaves(a), jax.tree.leaves(b), strict=True))


@pytest.mark.whole
def test_a_traced_program_found_again_computes_the_same(tmp_path: Path) -> None:
    setup = Setup.of(small_ppo())
    fresh = run(setup, None)
    first = run(setup, tmp_path)
    files = sorted(tmp_path.iterdir())
    assert [f.name.split("-")[0] for f in files] == ["chunk", "evaluate"]
    assert same(fresh, first)
    kept = [f.read_bytes() for f in files]
    files[0].write_bytes(kept[0][:-10])
    times = [f.stat().st_mtime_ns for f in files]
    assert same(first, run(setup, tmp_path))
    assert files[0].stat().st_mtime_ns != times[0]  # damaged: made again
    assert files[1].stat().st_mtime_ns == times[1]  # found
    times = [f.stat().st_mtime_ns for f in files]
    assert run(Setup.of(small_ppo(seed=3)), tmp_path)
    assert sorted(tmp_path.iterdir()) == files  # the seed is no part of the programs
    assert [f.stat().st_mtime_ns for f in files] == times
    run(Setup.of(small_ppo(reward=dataclasses.replace(setup.config.reward, weights={"vz": 1.0}))), tmp_path)
    assert len(list(tmp_path.iterdir())) == 4  # the reward is


def test_an_evaluation_is_the_same_on_one_device_and_on_two() -> None:
    """Nine starts on two devices: five each, the tenth a repetition."""
    setup = Setup.of(config())
    layers = setup.algorithm.init(setup.env, setup.config.algo, 0).policy
    env = next(iter(setup.judges.values()))
    two, one = (
        on_each(_evaluate(each), each.devices, (SAME, SAME, SAME), SAME, vehicles=each.watched)(
            env, layers, random_key(5)
        )
        for each in (setup, dataclasses.replace(setup, devices=1))
    )
    assert one.duration.shape == (9,)
    assert two.duration.shape == (10,)
    for a, b in zip(jax.tree.leaves(one), jax.tree.leaves(two), strict=True):
        np.testing.assert_allclose(a, b[:9], atol=1e-4)


def test_parts_of_the_episodes_are_the_whole() -> None:
    env = Env.of(TASKS["hover"].training(), config().reward)
    act = Act.of(lambda o: jnp.broadcast_to(env.hover, (o.shape[0], 4)))
    fly = jax.jit(lambda key, index: run_episodes(env, act, key, 7, 10, part=(index, 3)))
    whole = jax.jit(lambda key: run_episodes(env, act, key, 7, 10))(random_key(0))
    parts = [fly(random_key(0), i) for i in range(3)]
    for name in ("final_error", "top_speed", "duration"):
        joined = np.concatenate([getattr(p, name) for p in parts])[:7]
        np.testing.assert_allclose(joined, getattr(whole, name), atol=1e-5)


@pytest.mark.parametrize(
    ("envs", "minibatch", "asked", "count"),
    [(64, 512, None, 2), (63, None, None, 1), (40, None, None, 1), (7, 21, 1, 1)],
)
def test_how_many_devices_share(envs: int, minibatch: int | None, asked: int | None, count: int) -> None:
    assert len(jax.devices()) == 2
    assert share(envs, minibatch, asked) == count


@pytest.mark.parametrize(
    ("envs", "asked", "message"),
    [(64, 3, "devices is 3; accepted: 1 to 2"), (64, 0, "devices is 0"), (7, 2, r"devices is 2; accepted: a divisor")],
)
def test_devices_that_cannot_share(envs: int, asked: int, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        share(envs, None, asked)


def test_on_a_gpu_too_the_steps_of_a_chunk_are_loops(monkeypatch: pytest.MonkeyPatch) -> None:
    """A program whose windows, updates or sub-steps were unrolled would take a GPU minutes to compile."""
    monkeypatch.setattr(jax, "default_backend", lambda: "gpu")
    found = []
    for horizon, chunk in ((4, 2), (32, 20)):
        base = dataclasses.replace(config(), chunk=chunk, devices=1)
        setup = Setup.of(dataclasses.replace(base, algo=dataclasses.replace(base.algo, horizon=horizon)))
        parameters = setup.parameters()
        state = jax.eval_shape(start_program(setup), setup.env, parameters, random_key(0))
        program = on_each(_chunk(setup), 1, (SAME, SAME, OWN, SAME, SAME), (OWN, SAME))
        traced = program.trace(setup.env, setup.config.algo, state, 0, 40)
        text = traced.lower(lowering_platforms=("cuda",)).as_text()
        found.append((text.count(" stablehlo."), text.count("stablehlo.while")))
    assert found[0] == found[1]
    assert found[0][1] >= 5
