"""Compilation for tests: most of their time is XLA's, not the arithmetic's."""

from collections.abc import Callable
from typing import Any

import jax


def jit(f: Callable, **options: Any) -> Callable:
    """`jax.jit` that compiles in half of the time, to slower code."""
    return jax.jit(f, compiler_options={"xla_backend_optimization_level": 0}, **options)
