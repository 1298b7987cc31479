"""Race courses as solids."""

import jax
import jax.numpy as jnp
from jaxtyping import Array

from e2efly.courses.gates import FRAME, HALF_DEPTH, Gates, Tracks
from e2efly.simulation.scenes.scene import Solids

for _kind in (Gates, Tracks):
    jax.tree_util.register_dataclass(_kind, data_fields=list(_kind.__dataclass_fields__), meta_fields=[])


def frames(gates: Gates, n: int, bar: float | Array = FRAME, active: bool | Array = True) -> Solids:
    """The frames of gates as solids, the same in each of n worlds or individual ones. Gates that exist are active."""
    half = jnp.asarray(gates.half)
    size = jnp.concatenate([half, jnp.full_like(half[..., :1], bar), jnp.full_like(half[..., :1], HALF_DEPTH)], axis=-1)
    centre = jnp.asarray(gates.position)[..., :-1, :]
    yaw = jnp.arctan2(jnp.asarray(gates.sin), jnp.asarray(gates.cos))
    return Solids.of("gate", jnp.broadcast_to(centre, (n, *centre.shape[-2:])), size, yaw=yaw, active=active)
