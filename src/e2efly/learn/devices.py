"""The environments of a run, shared out among the devices: one program, each device on its part.

Within a program made by `on_each` every device has environments, random numbers and a replica of the parameters of its
own; gradients and metrics are averaged over the axis `AXIS`. The cores of a CPU count as devices: two threads that each
step their own vehicles take half the time, while two that share every small array operation take longer than one.
"""

from collections.abc import Callable
from typing import Any

import jax
import numpy as np
from jax.sharding import AxisType, Mesh, NamedSharding, PartitionSpec

from e2efly.device import wide_vectors
from e2efly.env import is_key, key_of, numbers_of

AXIS = "devices"
"""Name of the axis over which a program may take means and sums."""
SAME, OWN = PartitionSpec(), PartitionSpec(AXIS)
"""A value that every device has, and one whose leading axis is shared out."""
LEAST = 32
"""Environments that a device should have at least."""


def share(envs: int, minibatch: int | None, asked: int | None) -> int:
    """How many devices to share `envs` environments among: as many as divide the work, each with `LEAST` or more.

    Args:
        envs: environments of the run.
        minibatch: samples of a gradient step, where there are minibatches.
        asked: what the user wants; None: as many as there are.

    Raises:
        ValueError: when so many are not to be had or do not divide the work.
    """

    def divides(count: int) -> bool:
        return envs % count == 0 and (minibatch or 0) % count == 0

    found, hosts = len(jax.devices()), jax.process_count()
    if asked is None:
        most = max(1, min(found, envs // LEAST))
        fits = (count for count in range(most, 0, -1) if divides(count) and count % hosts == 0)
        asked = next(fits, hosts)
    if not 1 <= asked <= found:
        raise ValueError(f"devices is {asked}; accepted: 1 to {found}, which JAX has here")
    if asked % hosts:
        raise ValueError(f"devices is {asked}; accepted: a multiple of the number of processes ({hosts})")
    if not divides(asked):
        raise ValueError(f"devices is {asked}; accepted: a divisor of algo.envs ({envs}) and of algo.minibatch")
    return asked


def mesh(count: int, axis: str = AXIS) -> Mesh:
    """The first devices of each process, `count` in all."""
    each, hosts = count // jax.process_count(), range(jax.process_count())
    chosen = [d for host in hosts for d in [d for d in jax.devices() if d.process_index == host][:each]]
    return jax.make_mesh((count,), (axis,), axis_types=(AxisType.Auto,), devices=chosen)


def on_each(
    function: Callable,
    count: int,
    takes: Any,
    returns: Any,
    donate: tuple[int, ...] = (),
    axis: str = AXIS,
    vehicles: int = 0,
) -> Any:
    """`function`, compiled to run on each of `count` devices.

    Args:
        function: of the device's own parts; it may use collectives over `AXIS`.
        count: devices.
        takes: `SAME` or `OWN` for each argument (a tree of them for the parts of one).
        returns: the same for the result.
        donate: arguments whose memory the result may take.
        axis: name of the devices' axis, `AXIS` where what they hold belongs together.
        vehicles: how many a device steps together, where it is known: see `e2efly.device.wide_vectors`.
    """
    takes, returns = (
        jax.tree.map(lambda place: SAME if place == SAME else PartitionSpec(axis), x) for x in (takes, returns)
    )
    mapped = jax.shard_map(function, mesh=mesh(count, axis), in_specs=takes, out_specs=returns, check_vma=False)
    inside, outside = (shardings(x, count, axis) for x in (takes, returns))
    options = wide_vectors(vehicles)
    return jax.jit(mapped, in_shardings=inside, out_shardings=outside, donate_argnums=donate, compiler_options=options)


def shardings(places: Any, count: int, axis: str = AXIS) -> Any:
    """JAX's shardings of a tree of `SAME` and `OWN`."""
    return jax.tree.map(lambda place: NamedSharding(mesh(count, axis), place), places)


def placed(tree: Any, count: int) -> Any:
    """A tree from the host, with the leading axis of every leaf shared out."""

    def put(x: Any) -> jax.Array:
        return key_of(put(np.asarray(numbers_of(x)))) if is_key(x) else jax.device_put(x, shardings(OWN, count))

    return jax.tree.map(put, tree)


def own(tree: Any) -> Any:
    """The device's part of a tree whose leaves have one entry a device."""
    return jax.tree.map(lambda x: x[0], tree)


def stacked(tree: Any) -> Any:
    """The device's part with the leading axis that `own` takes off."""
    return jax.tree.map(lambda x: x[None], tree)
