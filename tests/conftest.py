"""Fixtures of the whole suite. The package computes in float32; a test that needs float64 asks for `x64`."""

from collections.abc import Iterator

import jax
import pytest


@pytest.fixture
def x64() -> Iterator[None]:
    with jax.enable_x64(True):
        yield
