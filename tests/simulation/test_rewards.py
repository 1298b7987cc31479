"""Every term by hand, its gradient by differences, its tag."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from e2efly.simulation import rewards
from e2efly.simulation.rewards import TERMS, reward

SIGNALS: dict[str, Any] = {
    "offset": [3.0, 4.0, 12.0],
    "previous_offset": [0.0, 0.0, 15.0],
    "way": 6.5,
    "previous_way": 7.0,
    "velocity": [2.0, -3.0, -6.0],
    "body_rate": [1.0, 2.0, -2.0],
    "action": [0.6, 0.0, 0.0, 0.8],
    "previous_action": [0.6, 0.0, 0.0, 0.3],
    "quaternion": [0.8, 0.6, 0.0, 0.0],
    "desired_quaternion": [1.0, 0.0, 0.0, 0.0],
    "yaw_error": -0.5,
    "roll_error": 0.4,
    "approaching": True,
    "pixel": [0.3, 0.4],
    "pixel_velocity": [0.1, 0.2],
    "height": 0.5,
    "clearance": 0.4,
    "approach_speed": 2.0,
    "arrived": True,
    "crashed": True,
    "desired_speed": 6.0,
    "desired_velocity": [2.0, 0.0, -2.0],
    "gaps": [0.3, 0.6],
    "closing": [1.5, 4.0],
    "misses": [0.1, 0.9, 0.4],
    "overhang": [-0.05, 0.01, 0.1],
    "expert_action": [0.6, 0.12, 0.0, 0.5],
}
DETACHED = {("avoid", "closing")}
"""What a term reads without gradient."""
BY_HAND = {
    "prog1": 15 - 13,
    "prog2": -13,
    "progway": 0.5,
    "progxy": -5,
    "progx": -3,
    "progy": -4,
    "progz": -12,
    "act1": -1,
    "act2": -0.5,
    "act3": -(0.025 * 1 + 0.002 * 0.5),
    "ori1": np.exp(-0.5),
    "ori2": -np.sqrt(0.2**2 + 0.6**2),
    "ori3": np.exp(-0.25 - 0.05),
    "ori4": -np.tan(0.4),
    "v1": -7,
    "v2": -1,
    "v3": -(np.e + 1),
    "vz": 1 / (1 + abs(0.5 - 6)),
    "anglev": -3,
    "avoid1": -1 / 0.5,
    "avoid2": -2 * ((1 - 0.28) ** 2 + 0.1 * np.log1p(np.exp(-32 * 0.28))),
    "goal": 1,
    "crash": -1,
    "near": np.exp(-13) + 0.5 * np.exp(-8 * 13),
    "alive": 1,
    "anglev_sq": -9,
    "anglevxy_sq": -5,
    "act2_sq": -0.25,
    "descent": -abs(0.5 / (1 + 25 / 0.09) - 6),
    "upright": -2 * 0.36,
    "imitate": -(0.13 - 0.05) - (np.hypot(0.3, 0.05) - 0.05),
    "vel": -5 / np.sqrt(8),
    "overspeed": -1,
    "avoid": -(0.5**2 + 0.5 * np.log1p(np.exp(-16 * 0.3))) * 2.5 - (0.2**2 + 0.5 * np.log1p(np.exp(-16 * 0.6))) * 5,
    "apart": -(0.5**2 + 0.2**2),
    "fit": -(0.03 + 0.1),
    "fitlog": -np.log(1 + 0.05 / 0.02) - np.log(1 + 0.11 / 0.02) - np.log(1 + 0.2 / 0.02),
}
SINGULAR: dict[str, Any] = {
    **SIGNALS,
    "offset": [0.0] * 3,
    "previous_offset": [0.0] * 3,
    "velocity": [0.0] * 3,
    "body_rate": [0.0] * 3,
    "action": [0.0] * 4,
    "previous_action": [0.0] * 4,
    "quaternion": [1.0, 0.0, 0.0, 0.0],
    "yaw_error": 0.0,
    "roll_error": np.pi / 2,
    "pixel": [0.0, 0.0],
    "clearance": 0.0,
    "approach_speed": 0.0,
    "desired_velocity": [0.0] * 3,
    "gaps": [0.0, 0.8],
    "closing": [0.0, 0.0],
    "misses": [0.6, 0.0, -0.2],
}


def inputs(name: str, signals: dict[str, Any]) -> dict[str, jax.Array]:
    term = TERMS[name]
    return {n: jnp.asarray(signals[n])[None] for n in [*term.inputs, *(n for n in term.parameters if n in signals)]}


@pytest.mark.parametrize("name", list(TERMS))
def test_by_hand(name: str) -> None:
    np.testing.assert_allclose(TERMS[name].function(**inputs(name, SIGNALS)), [BY_HAND[name]], rtol=2e-6)


@pytest.mark.whole(but=1)
@pytest.mark.usefixtures("x64")
@pytest.mark.parametrize("name", [n for n, t in TERMS.items() if t.kind != "sparse"])
def test_gradient_against_differences(name: str) -> None:
    given = inputs(name, SIGNALS)
    smooth = {k: v for k, v in given.items() if v.dtype != bool}

    def value(smooth: dict[str, jax.Array]) -> jax.Array:
        return TERMS[name].function(**{**given, **smooth})[0]

    exact = jax.grad(value)(smooth)
    for key, x in smooth.items():
        for i in range(x.size):
            step = jnp.zeros(x.size).at[i].set(1e-6).reshape(x.shape)
            numeric = (value({**smooth, key: x + step}) - value({**smooth, key: x - step})) / 2e-6
            if (name, key) in DETACHED:
                assert numeric != 0
                numeric = 0.0
            np.testing.assert_allclose(exact[key].ravel()[i], numeric, rtol=1e-6, atol=1e-8)


@pytest.mark.parametrize("name", [n for n, t in TERMS.items() if t.kind != "sparse"])
def test_gradient_is_finite_where_norms_and_angles_vanish(name: str) -> None:
    given = inputs(name, SINGULAR)
    smooth = {k: v for k, v in given.items() if v.dtype != bool}
    gradient = jax.grad(lambda s: TERMS[name].function(**{**given, **s})[0])(smooth)
    assert all(np.all(np.isfinite(g)) for g in gradient.values())


@pytest.mark.parametrize("name", ["goal", "crash"])
def test_sparse_terms_have_no_gradient(name: str) -> None:
    assert TERMS[name].kind == "sparse"
    given = {k: jnp.asarray(v)[None] for k, v in SIGNALS.items()}
    gradient = jax.grad(lambda v: reward({name: 3.0}, {}, {**given, "velocity": v})[0][0])(given["velocity"])
    np.testing.assert_array_equal(gradient, 0)


def test_prog1_charges_for_flying_away() -> None:
    near, far = jnp.array([[1.0, 0, 0]]), jnp.array([[2.0, 0, 0]])
    assert rewards.prog1(far, near)[0] == -1
    assert rewards.prog1(near, far)[0] == 1


def test_ori2_takes_q_and_minus_q_for_one_attitude() -> None:
    q = jnp.array([[0.5, 0.5, 0.5, 0.5]])
    np.testing.assert_allclose(rewards.ori2(-q, q), 0, atol=1e-7)


def test_avoid2_costs_nothing_while_leaving_and_more_when_nearer() -> None:
    def cost(clearance: float, speed: float) -> float:
        return float(rewards.avoid2(jnp.array([clearance]), jnp.array([speed]))[0])

    assert cost(0.2, -1.0) == 0
    assert cost(0.2, 1.0) < cost(0.6, 1.0) < cost(2.0, 1.0) <= 0


def test_the_sum_is_logged_term_by_term() -> None:
    given = {k: jnp.asarray(v)[None] for k, v in SIGNALS.items()}
    total, terms = reward({"prog2": 2.0, "v1": 0.5}, {}, given)
    assert float(terms["prog2"][0]) == -26
    assert float(total[0]) == pytest.approx(-26 - 3.5)


def test_parameters_of_the_configuration_are_used() -> None:
    given = {k: jnp.asarray(v)[None] for k, v in SIGNALS.items()}
    assert float(reward({"avoid1": 1.0}, {"avoid1_offset": 0.6}, given)[0][0]) == pytest.approx(-1.0)


def test_a_term_without_its_signal_is_refused() -> None:
    with pytest.raises(ValueError, match="'avoid1' needs clearance"):
        reward({"avoid1": 1.0}, {}, {})


def test_the_papers_groups_hold_each_term_once_and_a_term_of_no_group_stands_alone() -> None:
    members = [term for group in rewards.GROUPS.values() for term in group]
    assert len(members) == len(set(members))
    assert set(members) <= set(TERMS)
    found = rewards.grouped(["goal", "prog1", "fit", "anglev_sq", "crash", "near"])
    assert found == {"sparse": ("goal", "crash"), "prog": ("prog1", "near"), "fit": ("fit",), "anglev": ("anglev_sq",)}
    assert list(found) == ["sparse", "prog", "fit", "anglev"]
