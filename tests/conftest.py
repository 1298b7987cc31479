"""Fixtures of the whole suite. The package computes in float32; a test that needs float64 asks for `x64`."""

import os
from collections.abc import Iterator

from e2efly.device import set_xla_options

os.environ["JAX_NUM_CPU_DEVICES"] = "2"
set_xla_options()  # as the commands do, before anything computes

import jax  # noqa: E402
import pytest  # noqa: E402


@pytest.fixture
def x64() -> Iterator[None]:
    with jax.enable_x64(True):
        yield
