"""Random numbers: everything random of a run comes from keys that are made here."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import PRNGKeyArray

GENERATOR = "rbg"
"""XLA's own random generator: it compiles in a seventh of the time of JAX's default."""


def random_key(*seed: int) -> PRNGKeyArray:
    """The key of a seed, or of several numbers; made by NumPy: nothing to compile."""
    return jax.random.wrap_key_data(jnp.asarray(np.random.SeedSequence(seed).generate_state(4)), impl=GENERATOR)
