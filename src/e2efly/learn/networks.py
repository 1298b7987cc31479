"""Policy and critic: body-frame features of the observation, then a small multi-layer perceptron.

The features are part of the policy and of its exported graph: the observation stays what the vehicle measures.
"""

import math
from dataclasses import dataclass
from itertools import pairwise

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from e2efly.observation import Field
from e2efly.physics.rotation import unrotate

Layers = list[tuple[Array | np.ndarray, Array | np.ndarray]]
"""Weights (inputs, outputs) and biases of each layer."""

ACTIVATIONS = {"relu": jax.nn.relu, "tanh": jnp.tanh, "elu": jax.nn.elu}
"""Activations by name."""


@dataclass(frozen=True)
class Features:
    """What the networks are fed: static, as it is the same for every vehicle.

    World vectors are turned into the body frame and the attitude becomes the world's up axis seen from the body, so
    that nothing changes with the heading; every entry is divided by its field's scale.
    """

    fields: tuple[Field, ...]

    @property
    def size(self) -> int:
        """Numbers of the feature vector: the attitude's four become three."""
        return sum(3 if f.frame == "world_body" else f.size for f in self.fields)

    def __call__(self, observation: Float[Array, "*n o"]) -> Float[Array, "*n f"]:
        """The features of an observation."""
        offsets = np.cumsum([0, *(f.size for f in self.fields)])
        parts = {f: observation[..., a : a + f.size] for f, a in zip(self.fields, offsets, strict=False)}
        attitude = next(part for f, part in parts.items() if f.frame == "world_body")
        return jnp.concatenate([self._feature(f, part, attitude) for f, part in parts.items()], axis=-1)

    @staticmethod
    def _feature(field: Field, part: Array, attitude: Array) -> Array:
        if field.frame == "world_body":
            up = jnp.broadcast_to(jnp.array([0.0, 0.0, 1.0], part.dtype), (*part.shape[:-1], 3))
            return unrotate(attitude, up)
        if field.frame == "world":
            vectors = part.reshape(*part.shape[:-1], -1, 3)
            part = unrotate(attitude[..., None, :], vectors).reshape(part.shape)
        return part / field.scale


def init_mlp(rng: np.random.Generator, sizes: tuple[int, ...], last_gain: float) -> Layers:
    """Orthogonal layers (gain sqrt 2, the last one `last_gain`) and zero biases, in NumPy: nothing to compile."""
    layers = []
    for i, (n, m) in enumerate(pairwise(sizes)):
        gain = last_gain if i == len(sizes) - 2 else math.sqrt(2)
        q, r = np.linalg.qr(rng.standard_normal((max(n, m), min(n, m))))
        q = q * np.sign(np.diag(r))
        weight = gain * (q if n >= m else q.T)
        layers.append((weight.astype(np.float32), np.zeros(m, np.float32)))
    return layers


def mlp(layers: Layers, x: Float[Array, "*n f"], activation: str) -> Float[Array, "*n m"]:
    """A multi-layer perceptron, its last layer linear."""
    act = ACTIVATIONS[activation]
    for weight, bias in layers[:-1]:
        x = act(x @ weight + bias)
    weight, bias = layers[-1]
    return x @ weight + bias


def init_policy(rng: np.random.Generator, features: int, hidden: tuple[int, ...], hover: np.ndarray) -> Layers:
    """A policy that starts near `hover`, the action that hovers."""
    layers = init_mlp(rng, (features, *hidden, 4), 0.01)
    layers[-1] = (layers[-1][0], np.arctanh(np.clip(hover, -0.9, 0.9)).astype(np.float32))
    return layers


def policy(layers: Layers, features: Float[Array, "*n f"], activation: str) -> Float[Array, "*n 4"]:
    """The action: tanh of the network, in (-1, 1)."""
    return jnp.tanh(mlp(layers, features, activation))
