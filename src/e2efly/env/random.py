"""Random numbers: everything random of a run comes from keys that are made here."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, PRNGKeyArray

GENERATOR = "rbg"
"""XLA's own random generator: it compiles in a seventh of the time of JAX's default."""


def random_key(*seed: int) -> PRNGKeyArray:
    """The key of a seed, or of several numbers; made by NumPy: nothing to compile."""
    ended = (*seed, 1)  # NumPy fills up with zeros: (1,) and (1, 0) would be the same
    return key_of(jnp.asarray(np.random.SeedSequence(ended).generate_state(4)))


def is_key(x: Any) -> bool:
    """Whether an array, or a shape and type, is one of keys."""
    return hasattr(x, "dtype") and jnp.issubdtype(x.dtype, jax.dtypes.prng_key)


def numbers_of(x: Any) -> Any:
    """The numbers of keys; any other array as it is."""
    return jax.random.key_data(x) if is_key(x) else x


def key_of(numbers: Array | np.ndarray) -> PRNGKeyArray:
    """The keys of numbers."""
    return jax.random.wrap_key_data(jnp.asarray(numbers), impl=GENERATOR)
