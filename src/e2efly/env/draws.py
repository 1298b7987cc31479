"""What is drawn for each episode of a batch."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, PRNGKeyArray

from e2efly.tasks.task import uniform
from e2efly.vehicles import Vehicle
from e2efly.vehicles.posterior import WIDEST, Posterior

jax.tree_util.register_dataclass(Posterior, data_fields=["root"], meta_fields=["entries"])


def between(key: PRNGKeyArray, n: int, bounds: Float[Array | np.ndarray, "2"]) -> Float[Array, " n"]:
    """Numbers between two bounds, uniform."""
    return bounds[0] + (bounds[1] - bounds[0]) * jax.random.uniform(key, (n,), jnp.asarray(bounds).dtype)


def perturbed(key: PRNGKeyArray, n: int, nominal: Vehicle, widths: dict[str, Any], flown: Vehicle) -> dict[str, Array]:
    """Each named parameter of what flies times a uniform factor in 1 +- its width, entry by entry.

    `nominal` has the same fields without the axis of the batch that `flown` may have.
    """
    values = {name: jnp.asarray(getattr(nominal, name)) for name in sorted(widths)}
    ends = np.cumsum([value.size for value in values.values()])
    # one draw of all: on a CPU a dozen small ones take several times as long
    drawn = uniform(key, n, int(ends[-1]) if widths else 0)
    plant = {}
    for (name, value), end in zip(values.items(), ends, strict=True):
        factor = drawn[:, end - value.size : end].reshape(n, *value.shape).astype(value.dtype)
        plant[name] = getattr(flown, name) * (1 + widths[name] * factor)
    return plant


def around(
    key: PRNGKeyArray,
    n: int,
    vehicle: Vehicle,
    posterior: Posterior,
    latency_range: Float[Array | np.ndarray, "2"],
    late: Float[Array, " n"],
) -> tuple[dict[str, Array], Float[Array, " n"]]:
    """Vehicles as likely as their file says, and their delays.

    Args:
        key: of the draw.
        n: how many.
        vehicle: of the file.
        posterior: what the file says of its errors.
        latency_range: of the delay, the posterior's part included, s.
        late: delays that are uniform in it, s.

    Returns:
        Parameters by name, each (n, ...), and delays, s: what `late` is without the posterior's part, moved by a
        deviation that goes with those of the parameters.
    """
    dtype = late.dtype
    deviation = posterior.deviation(jax.random.normal(key, (n, len(posterior.entries)), dtype))
    plant = {name: value.astype(dtype) for name, value in posterior.values(vehicle, deviation).items()}
    reached = plant.pop("latency", None)
    if reached is None:
        return plant, late
    low, high = latency_range
    middle, margin = (low + high) / 2, WIDEST * posterior.latency_sigma
    width = jnp.maximum((high - low) / 2, 1e-12)
    inner = middle + (late - middle) * jnp.maximum(width - margin, 0.0) / width
    return plant, jnp.clip(inner + reached - vehicle.latency, low, high)
