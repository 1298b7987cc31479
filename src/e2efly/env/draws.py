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


def deviations(key: PRNGKeyArray, n: int, posterior: Posterior, dtype: Any) -> Float[Array, "n d"]:
    """Deviations of vehicles that are as likely as their file says."""
    return posterior.deviation(jax.random.normal(key, (n, posterior.root.shape[1]), dtype))


def delays(
    key: PRNGKeyArray,
    bounds: Float[Array | np.ndarray, "2"],
    nominal: Any,
    posterior: Posterior,
    deviation: Float[Array, "n d"],
) -> Float[Array, " n"]:
    """Delays, s: uniform within bounds, but for the posterior's part of them, which goes with the other deviations.

    Args:
        key: of the uniform part.
        bounds: of the whole, s. The lower one may have been cut off at zero.
        nominal: the vehicle's, s.
        posterior: of the vehicle.
        deviation: of its entries.
    """
    n = deviation.shape[0]
    if posterior.latency is None:
        return between(key, n, bounds)
    low, high = bounds
    margin = WIDEST * posterior.latency_sigma
    spread = jnp.stack([jnp.minimum(low + margin, nominal), high - margin])
    return jnp.clip(between(key, n, spread) + deviation[:, posterior.latency], low, high)
