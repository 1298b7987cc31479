"""Distribution of the environments of a run among the devices: one program, and each device works on its part.

Inside a program made by `on_each`, every device has its own environments, its own random numbers and its own copy of
the parameters. Gradients and metrics are averaged over the axis `AXIS`. The cores of a CPU count as devices: two
threads that each step their own vehicles take half the time, while two threads that share every small array operation
take longer than one.
"""

from collections.abc import Callable
from typing import Any

import jax
import numpy as np
from jax.sharding import AxisType, Mesh, NamedSharding, PartitionSpec

from e2efly.environment import is_key, key_of, numbers_of
from e2efly.simulation.device import wide_vectors

AXIS = "devices"
"""Name of the axis over which a program may take means and sums."""
SAME, OWN = PartitionSpec(), PartitionSpec(AXIS)
"""`SAME`: a value that is the same on every device. `OWN`: a value whose leading axis is divided among the devices."""
LEAST = 32
"""Minimum number of environments that a device should have."""


def share(envs: int, minibatch: int | None, asked: int | None, agents: int = 1) -> int:
    """The number of devices among which to divide `envs` environments: the largest number that divides the work evenly
    and gives each device `LEAST` environments or more.

    Args:
        envs: environments of the run.
        minibatch: samples of a gradient step, if the algorithm has minibatches.
        asked: the number that the user requests. None: as many as possible.
        agents: vehicles of a world, which are on the same device.

    Raises:
        ValueError: when so many devices are not available or do not divide the work.
    """
    if envs % agents:
        raise ValueError(f"algo.envs is {envs}; accepted: a multiple of {agents}, the vehicles of a world")

    def divides(count: int) -> bool:
        return envs // agents % count == 0 and (minibatch or 0) % count == 0

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
    """A mesh of the first devices of each process, `count` devices in total."""
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
        function: a function of the device's own parts. It may use collectives over `AXIS`.
        count: number of devices.
        takes: `SAME` or `OWN` for each argument, or a tree of them for the parts of an argument.
        returns: the same for the result.
        donate: arguments whose memory the result may use.
        axis: name of the axis of the devices: `AXIS` if their parts belong to one run.
        vehicles: number of vehicles that a device steps together, if known. See `device.wide_vectors`.
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
    """A tree from the host, with the leading axis of every leaf divided among the devices."""

    def put(x: Any) -> jax.Array:
        return key_of(put(np.asarray(numbers_of(x)))) if is_key(x) else jax.device_put(x, shardings(OWN, count))

    return jax.tree.map(put, tree)


def own(tree: Any) -> Any:
    """The device's part of a tree whose leaves have one entry per device."""
    return jax.tree.map(lambda x: x[0], tree)


def stacked(tree: Any) -> Any:
    """The device's part, with the leading axis that `own` removes."""
    return jax.tree.map(lambda x: x[None], tree)
