"""Replay buffers of off-policy methods: ring buffers that overwrite their oldest rows and are sampled at random."""

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
    """Number of rows written so far, including those that were overwritten."""

    @staticmethod
    def of(one: Any, rows: int) -> "Ring":
        """An empty ring buffer for rows like those of the tree `one` (n, ...)."""
        empty = jax.tree.map(lambda x: jnp.zeros((rows, *x.shape[1:]), x.dtype), one)
        return Ring(empty, jnp.zeros((), jnp.int32))

    @property
    def rows(self) -> int:
        """Number of rows that it can hold."""
        return jax.tree.leaves(self.data)[0].shape[0]

    def filled(self, new: Any) -> "Ring":
        """A copy in which the rows of `new` (m, ...) replace the oldest rows. m must divide the number of rows."""
        m = jax.tree.leaves(new)[0].shape[0]
        at = self.written % self.rows
        data = jax.tree.map(lambda old, x: jax.lax.dynamic_update_slice_in_dim(old, x, at, 0), self.data, new)
        return Ring(data, self.written + m)

    def drawn(self, key: PRNGKeyArray, m: int) -> Any:
        """Rows (m, ...), drawn uniformly with repetition from those written. At least one must have been written."""
        rows = jax.random.randint(key, (m,), 0, jnp.minimum(self.written, self.rows))
        return jax.tree.map(lambda x: x[rows], self.data)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Places:
    """Visited states of n environments, at which an environment can start again. Parts that all environments share are
    not stored.
    """

    ring: Ring
    """Ring buffer of the leaves that have one entry per environment."""
    last: Any
    """The newest tree, complete. It supplies the other leaves."""

    @staticmethod
    def of(first: Any, times: int) -> "Places":
        """A buffer with room for `times` trees like `first`, filled with copies of `first`."""
        n = _count(first)
        apart = [x for x in jax.tree.leaves(first) if x.shape[:1] == (n,)]
        return Places(Ring(jax.tree.map(lambda x: jnp.concatenate([x] * times), apart), jnp.int32(n * times)), first)

    def filled(self, new: Any) -> "Places":
        """A copy with another tree of states added."""
        n = _count(new)
        return Places(self.ring.filled([x for x in jax.tree.leaves(new) if x.shape[:1] == (n,)]), new)

    def drawn(self, key: PRNGKeyArray) -> Any:
        """A tree of states. The state of each environment is drawn at random from all stored states."""
        n = _count(self.last)
        leaves = iter(self.ring.drawn(key, n))
        return jax.tree.map(lambda x: next(leaves) if x.shape[:1] == (n,) else x, self.last)


def _count(tree: Any) -> int:
    """Number of environments in (state, observation, memory)."""
    return tree[1].shape[0]
