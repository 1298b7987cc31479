"""What the page's machine refuses, and what it may ignore."""

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from e2efly.policy import onnx_graph
from e2efly.viewing.web.lowering import NoInstructionError, lowered
from e2efly.viewing.web.policy_graph import OPERATORS


@pytest.mark.parametrize(
    ("function", "message"),
    [
        (jnp.sort, "computes by 'sort', an operation of JAX for which the page has no instruction; accepted: arith"),
        (lambda x: jax.lax.while_loop(lambda x: x[0] < 9, lambda x: x + 1, x), "computes by 'while'"),
        (lambda x: jnp.zeros((70, 70))[x[0].astype(int), x[1].astype(int)], "among 4900 places by 'dynamic_slice'"),
        (lambda x: jnp.zeros(9).at[x.astype(int)].set(1.0), "by 'scatter'; accepted: up to 4096, of one array"),
        (lambda x: x.at[np.array([1, 1])].add(x[:2]), "changes a number several times"),
    ],
)
def test_what_the_machine_cannot_do_is_refused_by_name(function: Callable[[Any], Any], message: str) -> None:
    with pytest.raises(NoInstructionError, match=message):
        lowered(lambda given: {"y": function(given["x"])}, {"x": np.zeros(3, np.float32)})


def test_a_state_that_draws_is_refused() -> None:
    with pytest.raises(NoInstructionError, match=r"random keys in its state, memory\.key; accepted: numbers"):
        lowered(lambda given: {"y": jax.random.normal(given["memory.key"])}, {"memory.key": jax.random.key(0)})


def test_what_no_output_needs_may_be_anything() -> None:
    def rewarded(given: dict[str, Any]) -> dict[str, Any]:
        _ = jnp.sort(given["x"])
        return {"y": given["x"].reshape(3, 1)}

    assert lowered(rewarded, {"x": np.zeros(3, np.float32)})["rows"] == []


def test_every_operator_of_a_policy_without_cameras_is_there() -> None:
    assert set(OPERATORS) == set(onnx_graph.OPERATORS) - {"Conv", "MaxPool", "AveragePool"}
