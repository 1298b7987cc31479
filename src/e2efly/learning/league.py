"""A league: past selves of a policy, which fly some of the vehicles of its training.

Self-play alone forgets: a policy that has only met its newest self fails among others (Lanctot et al. 2017). In every
second world, all vehicles but the first are flown by a past self, another one in each update.
"""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int, PRNGKeyArray


def founded(policy: Any, size: int) -> Any:
    """A league of so many members, each leaf (size, ...). At first, all are this policy."""
    return jax.tree.map(lambda x: np.broadcast_to(x, (size, *np.shape(x))).copy(), policy)


def seat(progress: Float[Array, ""], size: int) -> Int[Array, ""]:
    """The newest member's seat, at a completed fraction of the run in [0, 1]: each has its part of the run."""
    return jnp.minimum((progress * size).astype(jnp.int32), size - 1)


def joined(league: Any, policy: Any, newest: Int[Array, ""]) -> Any:
    """The league in which the newest member is this policy. The members before it stay as they are."""
    return jax.tree.map(lambda members, x: jnp.asarray(members).at[newest].set(x), league, policy)


def opponent(league: Any, key: PRNGKeyArray, newest: Int[Array, ""]) -> Any:
    """One of the members up to the newest, all with the same chance."""
    chosen = jax.random.randint(key, (), 0, newest + 1)
    return jax.tree.map(lambda members: members[chosen], league)


def flown_by_opponents(n: int, agents: int) -> Bool[np.ndarray, " n"]:
    """Which of n vehicles are flown by opponents."""
    rows = np.arange(n)
    return (rows // agents % 2 == 1) & (rows % agents > 0)
