"""The filter that a flight controller puts on its accelerometer."""

import jax.numpy as jnp
import numpy as np
import pytest

from e2efly.alignment.model import FILTERED, FORCE_FILTER, NUISANCES, _filtered
from e2efly.alignment.windows import STEP


def nuisances(factor: float) -> jnp.ndarray:
    return jnp.zeros(len(NUISANCES)).at[FILTERED].set(np.log(factor))


@pytest.mark.parametrize("factor", [1.0, 3.0])
def test_a_rising_force_comes_late_by_two_time_constants(factor: float) -> None:
    time = STEP * np.arange(400)
    found = np.asarray(_filtered(jnp.asarray(2.0 + 5.0 * time), nuisances(factor)))
    # each stage, which acts a step's end at a time, is late by its time constant less half a step
    late = (2.0 + 5.0 * time - found)[-1] / 5.0
    assert late == pytest.approx(2 * FORCE_FILTER * factor, abs=STEP)


def test_a_steady_force_passes_and_a_short_filter_changes_nothing() -> None:
    steady = jnp.full(50, 7.0)
    np.testing.assert_allclose(_filtered(steady, nuisances(1.0)), 7.0, rtol=1e-6)
    lively = jnp.asarray(np.random.default_rng(0).normal(size=50))
    np.testing.assert_allclose(_filtered(lively, nuisances(1e-3)), lively, atol=1e-6)
