"""Random numbers: everything random of a run comes from keys that are made here."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, PRNGKeyArray

UNSEEN = 4
"""The stream of the starts of `e2efly eval` and `validate`; those before it are of training (`e2efly.learn.judge`)."""
GENERATOR = "rbg"
"""XLA's own random generator: it compiles in a seventh of the time of JAX's default."""


def random_key(*seed: int) -> PRNGKeyArray:
    """The key of a seed, or of several numbers; made by NumPy: nothing to compile. Zeros at the end change nothing.

    A run draws from (seed,), what is flown for a purpose from (seed, stream, batch), streams being 1 and more.

    Raises:
        ValueError: for a negative one.
    """
    if min(seed, default=0) < 0:
        raise ValueError(f"seed is {min(seed)}; accepted: 0 or more")
    return key_of(jnp.asarray(np.random.SeedSequence(seed).generate_state(4)))


def is_key(x: Any) -> bool:
    """Whether an array, or a shape and type, is one of keys."""
    return hasattr(x, "dtype") and jnp.issubdtype(x.dtype, jax.dtypes.prng_key)


def numbers_of(x: Any) -> Any:
    """The numbers of keys; any other array as it is."""
    return jax.random.key_data(x) if is_key(x) else x


def key_of(numbers: Array | np.ndarray) -> PRNGKeyArray:
    """The keys of numbers."""
    return jax.random.wrap_key_data(jnp.asarray(numbers), impl=GENERATOR)
