"""What off-policy methods keep: rings of rows that are overwritten oldest first, and drawn from at random."""

from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Int, PRNGKeyArray


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Ring:
    """A ring buffer of rows."""

    data: Any
    """A tree whose leaves are (rows, ...)."""
    written: Int[Array, ""]
    """Rows ever written."""

    @staticmethod
    def of(one: Any, rows: int) -> "Ring":
        """An empty one for rows like those of a tree (n, ...)."""
        empty = jax.tree.map(lambda x: jnp.zeros((rows, *x.shape[1:]), x.dtype), one)
        return Ring(empty, jnp.zeros((), jnp.int32))

    @property
    def rows(self) -> int:
        """How many it holds."""
        return jax.tree.leaves(self.data)[0].shape[0]

    def filled(self, new: Any) -> "Ring":
        """With rows (m, ...) over the oldest; m divides the rows of the ring."""
        m = jax.tree.leaves(new)[0].shape[0]
        at = self.written % self.rows
        data = jax.tree.map(lambda old, x: jax.lax.dynamic_update_slice_in_dim(old, x, at, 0), self.data, new)
        return Ring(data, self.written + m)

    def drawn(self, key: PRNGKeyArray, m: int) -> Any:
        """Rows (m, ...), uniform among those written, with repetition; one must have been written."""
        rows = jax.random.randint(key, (m,), 0, jnp.minimum(self.written, self.rows))
        return jax.tree.map(lambda x: x[rows], self.data)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Places:
    """Visited states of n environments, to begin at again. Parts that all environments share are not kept."""

    ring: Ring
    """Of the leaves that have one entry an environment."""
    last: Any
    """The newest, whole: the rest of the leaves are as there."""

    @staticmethod
    def of(first: Any, times: int) -> "Places":
        """Room for `times` trees like `first`, filled with it."""
        n = _count(first)
        apart = [x for x in jax.tree.leaves(first) if x.shape[:1] == (n,)]
        return Places(Ring(jax.tree.map(lambda x: jnp.concatenate([x] * times), apart), jnp.int32(n * times)), first)

    def filled(self, new: Any) -> "Places":
        """With another tree of states."""
        n = _count(new)
        return Places(self.ring.filled([x for x in jax.tree.leaves(new) if x.shape[:1] == (n,)]), new)

    def drawn(self, key: PRNGKeyArray) -> Any:
        """A tree of states, each environment's from anywhere."""
        n = _count(self.last)
        leaves = iter(self.ring.drawn(key, n))
        return jax.tree.map(lambda x: next(leaves) if x.shape[:1] == (n,) else x, self.last)


def _count(tree: Any) -> int:
    """Environments of (state, observation, memory)."""
    return tree[1].shape[0]
