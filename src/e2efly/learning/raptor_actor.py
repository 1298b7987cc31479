"""RAPTOR's form (`e2efly.policy.raptor.raptor_form`) as a policy that learns."""

from collections.abc import Sequence
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from e2efly.config import CameraConfig, NetworkConfig, check_fields
from e2efly.learning.networks import Actor, Features, Gru, Layers, Weights, init_mlp
from e2efly.policy.observation import Field
from e2efly.policy.raptor.raptor_form import FIELDS, INPUTS, OUTPUTS, ROTOR_OF, UNITS, inputs_of
from e2efly.policy.raptor.raptor_network import Parameters, other_gates

SHORTEST, LONGEST = 0.3, 100.0
"""Time constants of the GRU's units in a fresh network, control steps."""


def actor_of(fields: tuple[Field, ...], cameras: Sequence[CameraConfig], network: NetworkConfig) -> Actor:
    """The policy of an environment's observation and cameras, in the network's form.

    Raises:
        ValueError: naming the field, the value and what is accepted.
    """
    if network.form == "features":
        return Actor.of(fields, cameras, network)
    check_fields("network", network)
    for name, value, accepted in (
        ("observation", {field.name: field.size for field in fields}, FIELDS),
        ("cameras", len(cameras), 0),
        ("network.hidden", network.hidden, (UNITS,)),
        ("network.recurrent", network.recurrent, UNITS),
        ("network.activation", network.activation, "relu"),
    ):
        if value != accepted:
            raise ValueError(f"{name} is {value!r}; accepted with network.form 'raptor': {accepted!r}")
    return RaptorActor(RaptorFeatures(fields), network)


@dataclass(frozen=True)
class RaptorFeatures(Features):
    """The 22 inputs."""

    @property
    def state_size(self) -> int:
        """Number of inputs."""
        return INPUTS

    def of_state(self, observation: Float[Array, "*n o"]) -> Float[Array, "*n s"]:
        """The inputs for an observation."""
        return inputs_of(observation)


@dataclass(frozen=True)
class RaptorActor(Actor):
    """The network. Of its weights, `encoders` holds the dense layer before the GRU."""

    def init(self, rng: np.random.Generator, hover: np.ndarray) -> Weights:
        """Initial weights. The policy starts with actions near `hover`.

        Everything passes through the GRU, so that some of its units have to answer at once and others to remember how
        the vehicle has answered. Their time constants begin spread out, up to `LONGEST` (as by C. Tallec and Y.
        Ollivier, Can recurrent neural networks warp time?, 2018).
        """
        first = init_mlp(rng, (INPUTS, UNITS), 2.0**0.5)
        of_input, of_memory = (init_mlp(rng, (UNITS, 3 * UNITS), 1.0)[0][0] for _ in range(2))
        bias = np.zeros(3 * UNITS, np.float32)
        bias[:UNITS] = np.log(np.geomspace(SHORTEST, LONGEST, UNITS))  # of the gate that keeps the memory
        weight, _ = init_mlp(rng, (UNITS, OUTPUTS), 0.01)[0]
        cell = Gru(of_input, of_memory, bias, np.zeros_like(bias))
        return Weights((first,), cell, [(weight, np.asarray(hover, np.float32)[list(ROTOR_OF)])])

    def __call__(
        self, weights: Weights, features: Float[Array, "*n f"], memory: Float[Array, "*n k"]
    ) -> tuple[Float[Array, "*n c"], Float[Array, "*n k"]]:
        """The action, which is not limited, and the next memory."""
        assert weights.cell is not None
        (weight, bias), (last, last_bias) = weights.encoders[0][0], weights.head[0]
        memory = weights.cell(jax.nn.relu(features @ weight + bias), memory)
        return (memory @ last + last_bias)[..., jnp.array(ROTOR_OF)], memory


def weights_of(parameters: Parameters) -> Weights:
    """The weights that a checkpoint's parameters are."""
    p = parameters
    first: Layers = [(p["layers/0/weights"].T, p["layers/0/biases"])]
    names = "weights_input", "weights_hidden", "biases_input", "biases_hidden"
    cell = Gru(*(other_gates(p[f"layers/1/{name}"]).T for name in names))
    return Weights((first,), cell, [(p["layers/2/weights"].T, p["layers/2/biases"])])
