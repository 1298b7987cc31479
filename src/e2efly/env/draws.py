"""What is drawn for each episode of a batch."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, PRNGKeyArray

from e2efly.tasks.task import uniform
from e2efly.vehicles import Vehicle


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
