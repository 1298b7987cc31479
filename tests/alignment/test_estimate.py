"""Fusion: the mean that the variances ask for, entry by entry, and contradictions that stop it."""

import numpy as np
import pytest

from e2efly.alignment.estimates import ContradictionError, Estimate, fuse


def estimate(value: object, sigma: object, source: str, name: str = "inertia") -> Estimate:
    return Estimate(name, np.array(value, float), np.array(sigma, float), source)


def test_the_surer_source_counts_more() -> None:
    found = fuse([estimate(1.0, 0.1, "a", "mass"), estimate(1.3, 0.2, "b", "mass")])["mass"]
    assert np.isclose(found.value, (1.0 / 0.01 + 1.3 / 0.04) / 125)
    assert np.isclose(found.sigma, 125**-0.5)
    assert found.source == "a; b"


def test_entries_that_one_source_lacks_are_the_others() -> None:
    nan = np.nan
    found = fuse([estimate([1.0, nan, nan], [0.1, nan, nan], "a"), estimate([1.0, 2.0, nan], [0.1, 0.3, nan], "b")])
    assert np.allclose(found["inertia"].value, [1.0, 2.0, nan], equal_nan=True)
    assert np.allclose(found["inertia"].sigma, [0.1 / np.sqrt(2), 0.3, nan], equal_nan=True)


def test_chance_is_fused_in_such_a_way_that_sigma_is_true() -> None:
    rng = np.random.default_rng(0)
    sigmas = np.array([0.1, 0.2, 0.05])
    said = rng.normal(0, sigmas, (4000, 3)).clip(-2 * sigmas, 2 * sigmas)
    found = [
        fuse([estimate(x, s, str(s), "mass") for x, s in zip(row, sigmas, strict=True)])["mass"] for row in said[:500]
    ]
    off = np.array([float(f.value / f.sigma) for f in found])
    assert 0.8 < np.std(off) < 1.0  # the tails were cut


def test_sources_that_cannot_both_be_true_stop_it() -> None:
    with pytest.raises(ContradictionError, match=r"inertia\[1\] is 2 \+- 0.1 by a and 3 \+- 0.2 by b: 4.5 standard"):
        fuse([estimate([1, 2, 3], [0.1, 0.1, 0.1], "a"), estimate([1, 3, 3], [0.1, 0.2, 0.1], "b")])
