"""Values that are drawn for each episode of a batch."""

from collections.abc import Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, PRNGKeyArray

from e2efly.tasks.task import uniform
from e2efly.vehicles.posterior import WIDEST, Posterior
from e2efly.vehicles.vehicle import Vehicle

jax.tree_util.register_dataclass(Posterior, data_fields=["root"], meta_fields=["entries"])


def between(key: PRNGKeyArray, n: int, bounds: Float[Array | np.ndarray, "2"]) -> Float[Array, " n"]:
    """Uniform random numbers between two bounds."""
    return bounds[0] + (bounds[1] - bounds[0]) * jax.random.uniform(key, (n,), jnp.asarray(bounds).dtype)


def sometimes(key: PRNGKeyArray, n: int, largest: Sequence[Any]) -> Float[Array, "n k"]:
    """Strengths of effects that half of the episodes do not have: 0, or uniform between 0 and the largest."""
    return jnp.asarray(largest) * jnp.maximum(uniform(key, n, len(largest)), 0.0)


def perturbed(key: PRNGKeyArray, n: int, nominal: Vehicle, widths: dict[str, Any], flown: Vehicle) -> dict[str, Array]:
    """Multiply each named parameter of what flies by a uniform factor in 1 +- its width, entry by entry.

    `nominal` has the same fields, without the batch axis that `flown` may have.
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


def deviations(key: PRNGKeyArray, n: int, posterior: Posterior, dtype: Any) -> Float[Array, "n d"]:
    """Deviations of vehicles from their file, drawn from the distribution that the file gives."""
    return posterior.deviation(jax.random.normal(key, (n, posterior.root.shape[1]), dtype))


def delays(
    key: PRNGKeyArray,
    bounds: Float[Array | np.ndarray, "2"],
    nominal: Any,
    posterior: Posterior,
    deviation: Float[Array, "n d"],
) -> Float[Array, " n"]:
    """Delays, s: uniform within bounds, except the posterior's part, which is drawn with the other deviations.

    Args:
        key: the random key of the uniform part.
        bounds: the bounds of the total delay, s. The lower one may have been clipped at zero.
        nominal: the vehicle's delay, s.
        posterior: the posterior of the vehicle.
        deviation: the deviations of its entries.
    """
    n = deviation.shape[0]
    if posterior.latency is None:
        return between(key, n, bounds)
    low, high = bounds
    margin = WIDEST * posterior.latency_sigma
    spread = jnp.stack([jnp.minimum(low + margin, nominal), high - margin])
    return jnp.clip(between(key, n, spread) + deviation[:, posterior.latency], low, high)
