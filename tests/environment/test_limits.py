"""What a configuration says of the sensing that its training covers."""

import dataclasses
from pathlib import Path

import pytest

from e2efly.config import EnvConfig, EstimateConfig, LinkConfig
from e2efly.environment import Env
from e2efly.environment.limits import sensing_of
from e2efly.policy.contract import SENSING
from e2efly.policy.loader import load_policy
from e2efly.runs import presets
from tests.policy.made import made


def test_age_and_hold_follow_from_latencies_and_rate_and_lags_are_as_given() -> None:
    config = EnvConfig(observation_latency=(0.01, 0.02))
    most = {part.name: part.high for part in sensing_of(config, (0.02, 0.06), 50.0)}
    assert list(most) == list(SENSING)
    assert most.pop("pose_age") == pytest.approx(0.08) and most.pop("hold") == pytest.approx(0.02)
    assert set(most.values()) == {0.0}
    drawn = dataclasses.replace(
        config, estimate=EstimateConfig(velocity_lag=0.08, hold=4.0), link=LinkConfig(dropped=0.1)
    )
    wide = sensing_of(drawn, (0.02, 0.06), 50.0)
    found = {part.name: part.high for part in wide}
    assert (found["velocity_lag"], found["hold"], found["dropped"]) == pytest.approx((0.08, 0.1, 0.1))
    assert all(part.low == 0 and part.unit == SENSING[part.name] for part in wide)


def test_an_exported_policy_says_what_its_training_covered(tmp_path: Path) -> None:
    config = presets.preset("hover", "ppo")
    config = dataclasses.replace(
        config, env=dataclasses.replace(config.env, action_latency=(0.01, 0.05), observation_latency=(0.0, 0.03))
    )
    contract = load_policy(made(tmp_path / "policy.onnx", 0.1, config=config)).contract
    assert contract.sensing == sensing_of(config.env, contract.latency_range_s, contract.control_rate_hz)
    assert {part.name: part.high for part in contract.sensing or ()}["pose_age"] == pytest.approx(0.08)


@pytest.mark.parametrize(
    ("given", "own"), [(None, 0.06), ((0.01, 0.09), 0.06), ((0.01, 0.03), 0.02), ((0.08, 0.1), 0.09)]
)
def test_by_itself_a_vehicle_has_a_latency_that_its_training_has(
    tmp_path: Path, given: tuple[float, float] | None, own: float
) -> None:
    """In the simulator without disturbances, in the rows of the stress and in the contract, whatever its file says."""
    config = presets.preset("hover", "ppo")
    config = dataclasses.replace(config, env=dataclasses.replace(config.env, action_latency=given))
    env = Env.of(config.task, config.reward, config.env)
    assert env.latency == pytest.approx(own)
    assert env.undisturbed().latency_range == pytest.approx(own)
    assert load_policy(made(tmp_path / "policy.onnx", 0.1, config=config)).contract.latency_s == pytest.approx(own)
