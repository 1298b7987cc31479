"""Policy and critic: features of the observation and the images, encoders of the images, optionally a GRU, then a
multi-layer perceptron.

The features are part of the policy and of its exported graph. The inputs of the graph are therefore the observation and
the images as the vehicle measures them.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from e2efly.config import CameraConfig, NetworkConfig, check_fields
from e2efly.control.vectors import unrotate
from e2efly.policy.observation import Field

Layers = list[tuple[Array | np.ndarray, Array | np.ndarray]]
"""Weights (inputs, outputs) and biases of each layer."""

ACTIVATIONS = {"relu": jax.nn.relu, "tanh": jnp.tanh, "elu": jax.nn.elu}
"""Activations by name."""


NEAREST = 0.3
"""Lower limit of the depth before it is encoded, m. Smaller depths have the same encoding as this one."""
FAINTEST = 1e-2
"""Added to the norm of a mask before the mask is divided by it, because the norm of an empty mask is 0."""


@dataclass(frozen=True)
class View:
    """One camera's part of the features and its encoder. The features are its image, averaged over the cells of a grid.
    For depth, the nearest value of each cell is kept instead.

    A mask is given twice: as it is, and divided by its norm. Far objects cover few pixels; after the division they are
    as clear as near ones.
    """

    camera: CameraConfig
    rows: int
    columns: int
    patches: tuple[int, ...] = ()
    """Side lengths of the patches of the encoder's convolutions, pixels."""

    @staticmethod
    def of(camera: CameraConfig, network: NetworkConfig) -> "View":
        """Create the view. Check that the grid or the convolutions divide the image, and that a network can use the
        image.

        Raises:
            ValueError: naming the field, the value and what is accepted.
        """
        if camera.sees in ("label", "instance"):
            raise ValueError(f"camera.sees is {camera.sees!r}; accepted for a policy: depth, range, mask, rgb, normal")
        if network.convolution:
            return View(camera, camera.height, camera.width, _patches(camera, network.convolution))
        pool = network.pool
        rows, columns = min(pool[0], camera.height), min(pool[1], camera.width)
        if rows < 1 or columns < 1 or camera.height % rows or camera.width % columns:
            raise ValueError(
                f"network.pool is {pool}; accepted: divisors of the image's {camera.height} rows and "
                f"{camera.width} columns"
            )
        return View(camera, rows, columns)

    @property
    def channels(self) -> int:
        """Number of channels of the features."""
        return {"mask": 2, "rgb": 3, "normal": 3}.get(self.camera.sees, 1)

    @property
    def size(self) -> int:
        """Number of values that the encoder takes, ordered by rows, then columns, then channels."""
        return self.rows * self.columns * self.channels

    @property
    def measures(self) -> bool:
        """Whether the camera measures distance. A cell then shows the nearest value, not the mean."""
        return self.camera.sees in ("depth", "range")

    @property
    def contrast(self) -> float:
        """Factor of a mask divided by its norm. The result is the mask divided by four times its root mean square."""
        return math.sqrt(self.rows * self.columns) / 4

    def __call__(self, image: Float[Array, "*image"]) -> Float[Array, "*n f"]:
        """The features of an image."""
        c = self.camera
        channels = 3 if c.sees in ("rgb", "normal") else 1
        if self.measures:
            image = _encoded(c, image)
        lead = image.shape[: image.ndim - (3 if channels == 3 else 2)]
        cells = image.reshape(*lead, self.rows, c.height // self.rows, self.columns, c.width // self.columns, channels)
        x = (jnp.max if self.measures else jnp.mean)(cells, axis=(-4, -2))
        if c.sees == "mask":
            norm = jnp.sqrt(jnp.sum(x**2, axis=(-3, -2, -1), keepdims=True))
            x = jnp.concatenate([x, self.contrast * x / (norm + FAINTEST)], axis=-1)
        return x.reshape(*lead, -1)

    def init(self, rng: np.random.Generator, network: NetworkConfig) -> Layers:
        """Weights of the encoder: first of each convolution, (side * side * channels, next channels), then of the
        layers.
        """
        layers, shape = [], (self.rows, self.columns, self.channels)
        for side, channels in zip(self.patches, network.convolution, strict=True):
            layers += init_mlp(rng, (side * side * shape[2], channels), math.sqrt(2))
            shape = (shape[0] // side, shape[1] // side, channels)
        return layers + init_mlp(rng, (math.prod(shape), *network.encoder), math.sqrt(2))

    def encode(self, layers: Layers, features: Float[Array, "*n f"], activation: str) -> Float[Array, "*n e"]:
        """The output of the encoder for the features of an image."""
        act, lead = ACTIVATIONS[activation], features.shape[:-1]
        x = features.reshape(*lead, self.rows, self.columns, self.channels)
        for side, (weight, bias) in zip(self.patches, layers, strict=False):
            *_, rows, columns, channels = x.shape
            x = x.reshape(*lead, rows // side, side, columns // side, side, channels)
            x = jnp.swapaxes(x, -4, -3).reshape(*lead, rows // side, columns // side, side * side * channels)
            x = act(x @ weight + bias)
        return act(mlp(layers[len(self.patches) :], x.reshape(*lead, -1), activation))


def _encoded(camera: CameraConfig, image: Array) -> Array:
    """The depth as encoded for the network. It is 0 for the largest depth and for a hole, because most holes are beyond
    the range of the camera.
    """
    far = camera.reach[1]
    depth = jnp.maximum(jnp.where(image > 0, image, far), NEAREST)
    if camera.encoding == "inverse":
        return 1.0 / depth - 1.0 / far
    return jnp.log(far / depth) if camera.encoding == "log" else 1.0 - depth / far


def _patches(camera: CameraConfig, convolution: tuple[int, ...]) -> tuple[int, ...]:
    """The side length of the patches of each convolution, pixels."""
    sides, rows, columns = [], camera.height, camera.width
    for _ in convolution:
        side = next((k for k in (4, 2) if rows % k == 0 and columns % k == 0), None)
        if side is None:
            raise ValueError(
                f"network.convolution is {convolution}; accepted: no more layers than halve or quarter the image's "
                f"{camera.height} rows and {camera.width} columns: {len(sides)}"
            )
        sides.append(side)
        rows, columns = rows // side, columns // side
    return tuple(sides)


@dataclass(frozen=True)
class Features:
    """The inputs of the networks. This class is static, because it is the same for every vehicle.

    World vectors are rotated into the body frame, and the attitude becomes the world's up axis in the body frame. The
    features therefore do not change with the heading. Every entry is divided by the scale of its field. The features of
    the images come last.
    """

    fields: tuple[Field, ...]
    views: tuple[View, ...] = ()

    @property
    def state_size(self) -> int:
        """Number of the observation's features. The four numbers of the attitude become three."""
        return sum(3 if f.frame == "world_body" else f.size for f in self.fields)

    @property
    def size(self) -> int:
        """Length of the feature vector."""
        return self.state_size + sum(view.size for view in self.views)

    def __call__(self, observation: Float[Array, "*n o"], images: Sequence[Array] = ()) -> Float[Array, "*n f"]:
        """The features of an observation and of the cameras' images."""
        state = self.of_state(observation)
        seen = [view(image) for view, image in zip(self.views, images, strict=True)]
        return jnp.concatenate([state, *seen], axis=-1) if seen else state

    def apart(self, features: Float[Array, "*n f"]) -> list[Float[Array, "*n p"]]:
        """The part of the observation in a feature vector, and the part of each image."""
        ends = np.cumsum([self.state_size, *(view.size for view in self.views)])
        return jnp.split(features, ends[:-1], axis=-1) if self.views else [features]

    def of_state(self, observation: Float[Array, "*n o"]) -> Float[Array, "*n s"]:
        """The features of an observation alone."""
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
    """Orthogonal layers (gain sqrt 2, for the last layer `last_gain`) and zero biases. Made with NumPy, so that nothing
    has to be compiled.
    """
    layers = []
    for i, (n, m) in enumerate(pairwise(sizes)):
        gain = last_gain if i == len(sizes) - 2 else math.sqrt(2)
        q, r = np.linalg.qr(rng.standard_normal((max(n, m), min(n, m))))
        q = q * np.sign(np.diag(r))
        weight = gain * (q if n >= m else q.T)
        layers.append((weight.astype(np.float32), np.zeros(m, np.float32)))
    return layers


def mlp(layers: Layers, x: Float[Array, "*n f"], activation: str) -> Float[Array, "*n m"]:
    """A multi-layer perceptron with a linear last layer."""
    act = ACTIVATIONS[activation]
    for weight, bias in layers[:-1]:
        x = act(x @ weight + bias)
    weight, bias = layers[-1]
    return x @ weight + bias


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Gru:
    """A gated recurrent unit (Cho et al. 2014). The three gates are side by side in each array: update, reset,
    candidate.
    """

    inputs: Array | np.ndarray
    """Weights of the inputs, (i, 3 k)."""
    recurrent: Array | np.ndarray
    """Weights of the memory, (k, 3 k)."""
    bias: Array | np.ndarray
    """Bias added to the inputs' part, (3 k,)."""
    recurrent_bias: Array | np.ndarray
    """Bias added to the memory's part, (3 k,)."""

    def __call__(self, x: Float[Array, "*n i"], memory: Float[Array, "*n k"]) -> Float[Array, "*n k"]:
        """The next memory."""
        update, reset, candidate = jnp.split(x @ self.inputs + self.bias, 3, axis=-1)
        by_update, by_reset, by_candidate = jnp.split(memory @ self.recurrent + self.recurrent_bias, 3, axis=-1)
        keep = jax.nn.sigmoid(update + by_update)
        new = jnp.tanh(candidate + jax.nn.sigmoid(reset + by_reset) * by_candidate)
        return (1 - keep) * new + keep * memory


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Weights:
    """What a policy learns."""

    encoders: tuple[Layers, ...]
    """One encoder per image."""
    cell: Gru | None
    head: Layers


@dataclass(frozen=True)
class Actor:
    """The structure of a policy: features, encoders, GRU, head. Its weights are passed at every call."""

    features: Features
    network: NetworkConfig

    @staticmethod
    def of(fields: tuple[Field, ...], cameras: Sequence[CameraConfig], network: NetworkConfig) -> "Actor":
        """The policy of an environment's observation and cameras.

        Raises:
            ValueError: naming the field, the value and what is accepted.
        """
        check_fields("network", network)
        if cameras and not network.encoder:
            raise ValueError("network.encoder is (); accepted: one size or more where there are cameras")
        return Actor(Features(fields, tuple(View.of(camera, network) for camera in cameras)), network)

    def init(self, rng: np.random.Generator, hover: np.ndarray) -> Weights:
        """Initial weights. The policy starts with actions near `hover`, the action at which the vehicle hovers. Made
        with NumPy, so that nothing has to be compiled.
        """
        encoders = tuple(view.init(rng, self.network) for view in self.features.views)
        size = self.features.state_size + len(encoders) * self.network.encoder[-1]
        cell, units = None, self.network.recurrent
        if units:
            (recurrent, _), zero = init_mlp(rng, (units, 3 * units), 1.0)[0], np.zeros(3 * units, np.float32)
            cell = Gru(init_mlp(rng, (size, 3 * units), 1.0)[0][0], recurrent, zero, zero)
            size += units
        head = init_mlp(rng, (size, *self.network.hidden, len(hover)), 0.01)
        head[-1] = (head[-1][0], np.arctanh(np.clip(hover, -0.9, 0.9)).astype(np.float32))
        return Weights(encoders, cell, head)

    def memory(self, n: int) -> Float[Array, "n k"]:
        """The memories of n GRUs at the start of an episode: zeros."""
        return jnp.zeros((n, self.network.recurrent))

    def __call__(
        self, weights: Weights, features: Float[Array, "*n f"], memory: Float[Array, "*n k"]
    ) -> tuple[Float[Array, "*n c"], Float[Array, "*n k"]]:
        """The action (tanh of the network, in (-1, 1)) and the GRU's next memory."""
        activation = self.network.activation
        state, *images = self.features.apart(features)
        of_images = zip(self.features.views, weights.encoders, images, strict=True)
        encoded = [view.encode(layers, x, activation) for view, layers, x in of_images]
        x = jnp.concatenate([state, *encoded], axis=-1) if encoded else state
        if weights.cell is not None:
            memory = weights.cell(x, memory)
            x = jnp.concatenate([x, memory], axis=-1)
        return jnp.tanh(mlp(weights.head, x, activation)), memory
