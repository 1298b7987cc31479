"""What cannot fit or end is refused before it begins; what fits is not."""

import dataclasses
import math

import pytest

from e2efly.commands.cli import run
from e2efly.config import ALGORITHMS, EnvConfig, NetworkConfig, budget
from e2efly.learning.run_budget import run_memory
from e2efly.learning.setup import Setup
from e2efly.runs import presets
from e2efly.tasks import TASKS

SMALL = presets.preset("hover", "ppo")
PPO = "train hover --algo ppo --preset nominal"


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ("train hover --steps 1" + 15 * "0", "days, even at 100 million steps per second; accepted: what takes at mo"),
        (f"{PPO} --steps 10" + 12 * "0", "accepted: at most 8796093018112: int32 counts updates and samples"),
        (f"{PPO} --algo.envs 2000000000", "algo.envs is 2000000000, algo.horizon 64, with 21 observed numb"),
        (f"{PPO} --algo.horizon 2000000000", "algo.envs is 64, algo.horizon 2000000000, with 21 observed"),
        (f"{PPO} --algo.epochs 2000000000", "chunk 20, algo.epochs 2000000000: about 588 days, even"),
        (f"{PPO} --network.hidden 200000 200000", "network.hidden is (200000, 200000), recurrent 0, encoder"),
        ("train hover --network.recurrent 1000000", "recurrent 1000000, encoder (64,), convolution ()"),
        ("train hover --chunk 1000000000", "chunk is 1000000000: about 4 TB of memory; accepted: what fits into the"),
        (f"{PPO} --eval-episodes 1000000000", "eval_episodes is 1000000000, with 21 observed numbers: about 1.1"),
        ("train hover --algo abpt --algo.buffer 2000000000", "algo.buffer is 2000000000: about"),
        ("train hover --algo abpt --algo.fits 2000000000", "algo.fits 2000000000, algo.minibatch 1024: about"),
        ("train avoid --task.forest.room 1000000000", "task.forest.room 1000000000, images of 32 x 12: about"),
        ("train avoid --network.convolution 1000000", "convolution (1000000,), with 30 observed numbers"),
        ("eval hover --episodes 10000000000", "--episodes is 10000000000: about 2 TB of memory; accepted: what fits"),
        ("validate hover --episodes 10000000000", "--episodes is 10000000000: about 358 TB of memory; accepted: what"),
        ("validate hover --flights 1000000000", "--flights is 1000000000: about 31.7 years, at 1 s each; accepted: "),
        ("sweep hover --seeds 1000000000", "--seeds is 1000000000, 1e+09 runs: about 158 years, at 5 s each; accept"),
        ("ablate hover --seeds 1000000000", "5000000000 runs together: about"),
    ],
)
def test_numbers_too_large_are_refused_with_what_they_would_take(
    arguments: str, said: str, capsys: pytest.CaptureFixture[str], tmp_path: object
) -> None:
    where = [] if arguments.startswith(("eval", "validate")) else ["--out", f"{tmp_path}/run"]
    assert run([*arguments.split(), *where]) == 2
    assert said in " ".join(capsys.readouterr().err.split())


def test_a_machine_with_more_memory_takes_more() -> None:
    config = dataclasses.replace(SMALL, algo=dataclasses.replace(SMALL.algo, envs=2**20))
    setup = Setup.of(SMALL)
    parts = run_memory(config, setup.env, setup.actor)
    needed = sum(parts.values())
    assert 2e10 < needed < 2e11
    budget.check_memory(parts, memory=needed)
    with pytest.raises(ValueError, match=r"algo.envs is 1048576.*accepted: what fits into the .* GB of this machine"):
        budget.check_memory(parts, memory=0.99 * needed)


def test_an_estimate_is_near_to_what_the_programs_take() -> None:
    """1224 bytes a step in XLA's own account of hover by PPO."""
    few, many = (dataclasses.replace(SMALL, algo=dataclasses.replace(SMALL.algo, envs=n)) for n in (1024, 2048))
    setup = Setup.of(SMALL)
    took = [sum(run_memory(config, setup.env, setup.actor).values()) for config in (few, many)]
    assert (took[1] - took[0]) / (1024 * 64) == pytest.approx(1224, rel=0.5)


@pytest.mark.parametrize("task", TASKS)
def test_no_preset_is_refused_by_a_small_machine(task: str) -> None:
    for algo in ALGORITHMS:
        setup = Setup.of(presets.preset(task, algo))
        assert sum(run_memory(setup.config, setup.env, setup.actor).values()) < 2e9


def test_the_memory_of_this_machine_is_found() -> None:
    assert 1e8 < budget.machine_memory() < math.inf


def test_every_number_counts() -> None:
    setup = Setup.of(SMALL)

    def took(**changes: object) -> float:
        return sum(run_memory(dataclasses.replace(SMALL, **changes), setup.env, setup.actor).values())

    assert took(chunk=40) > took(chunk=20)
    assert took(eval_episodes=500) > took(eval_episodes=250)
    wide = Setup.of(dataclasses.replace(SMALL, network=NetworkConfig((512, 512))))
    late = Setup.of(dataclasses.replace(SMALL, env=EnvConfig(past_actions=100)))
    for other in (wide, late):
        assert sum(run_memory(other.config, other.env, other.actor).values()) > took()
