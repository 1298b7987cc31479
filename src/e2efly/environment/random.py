"""Random numbers: everything random of a run comes from keys that are made here."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, PRNGKeyArray

UNSEEN = 4
"""The stream of the starts of `e2efly eval` and `validate`. Lower streams are for training (`learning/judge.py`)."""
GENERATOR = "rbg"
"""XLA's own random generator: it compiles in a seventh of the time of JAX's default."""


def random_key(*seed: int) -> PRNGKeyArray:
    """The key for a seed or for several numbers. NumPy makes it, so nothing is compiled. Trailing zeros have no effect.

    A run draws from (seed,). Flights for a particular purpose draw from (seed, stream, batch), with streams from 1.

    Raises:
        ValueError: for a negative number.
    """
    if min(seed, default=0) < 0:
        raise ValueError(f"seed is {min(seed)}; accepted: 0 or more")
    return key_of(jnp.asarray(np.random.SeedSequence(seed).generate_state(4)))


def is_key(x: Any) -> bool:
    """Whether an array, or a shape and type, is one of keys."""
    return hasattr(x, "dtype") and jnp.issubdtype(x.dtype, jax.dtypes.prng_key)


def numbers_of(x: Any) -> Any:
    """The numbers of keys. Any other array is returned unchanged."""
    return jax.random.key_data(x) if is_key(x) else x


def key_of(numbers: Array | np.ndarray) -> PRNGKeyArray:
    """The keys for numbers."""
    return jax.random.wrap_key_data(jnp.asarray(numbers), impl=GENERATOR)
