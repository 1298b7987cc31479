"""The network of RAPTOR's form in plain numbers, as RLtools lays it out: weights (outputs, inputs), and of the GRU the
gates reset, update, candidate, one below the other.
"""

from collections.abc import Mapping

import numpy as np
import onnx
from onnx import numpy_helper

from e2efly.policy.loader import Policy
from e2efly.policy.raptor.raptor_form import INPUTS, OUTPUTS, ROTOR_OF, UNITS, check_form, inputs_of

Parameters = Mapping[str, np.ndarray]
"""The parameters of a network, float32, by their path in a checkpoint: the keys of `SHAPES`, in its order."""
SHAPES: dict[str, tuple[int, ...]] = {
    "layers/0/weights": (UNITS, INPUTS),
    "layers/0/biases": (UNITS,),
    "layers/1/weights_input": (3 * UNITS, UNITS),
    "layers/1/biases_input": (3 * UNITS,),
    "layers/1/weights_hidden": (3 * UNITS, UNITS),
    "layers/1/biases_hidden": (3 * UNITS,),
    "layers/1/initial_hidden_state": (UNITS,),
    "layers/2/weights": (OUTPUTS, UNITS),
    "layers/2/biases": (OUTPUTS,),
}
"""The shape of each parameter."""
CONSTANTS = {
    "layers/0/weights": "dense_weight_0",
    "layers/0/biases": "dense_bias_0",
    "layers/1/weights_input": "gru_inputs",
    "layers/1/biases_input": "gru_bias",
    "layers/1/weights_hidden": "gru_recurrent",
    "layers/1/biases_hidden": "gru_recurrent_bias",
    "layers/2/weights": "weight_0",
    "layers/2/biases": "bias_0",
}
"""The constant of the ONNX graph (`e2efly.learning.raptor_actor`) that holds a parameter, transposed."""
AGREES = 1e-5
"""Largest difference of a command from that of the policy whose parameters were taken."""


def other_gates(parameter: np.ndarray) -> np.ndarray:
    """A parameter of the GRU, (48, *n), with the gates reset and update exchanged: between our order and RLtools'."""
    reset, update, candidate = np.split(parameter, 3)
    return np.concatenate([update, reset, candidate])


def check_parameters(parameters: Parameters) -> None:
    """Check that the parameters are those of the form.

    Raises:
        ValueError: naming the parameter, its shape or value, and what is accepted.
    """
    for name, shape in SHAPES.items():
        if name not in parameters:
            raise ValueError(f"{name} is missing; accepted in RAPTOR's form: {', '.join(SHAPES)}")
        if parameters[name].shape != shape:
            raise ValueError(f"{name} has shape {parameters[name].shape}; accepted in RAPTOR's form: {shape}")
        if not np.isfinite(parameters[name]).all():
            raise ValueError(f"{name} is not finite; accepted: finite numbers")


def commands(parameters: Parameters, inputs: np.ndarray) -> np.ndarray:
    """The commands, (t, n, 4), for a sequence of inputs, (t, n, 22), from the initial hidden state on. Float32."""
    p, units = parameters, UNITS
    state = np.tile(p["layers/1/initial_hidden_state"], (inputs.shape[1], 1))
    given = []
    for x in np.asarray(inputs, np.float32):
        x = np.maximum(x @ p["layers/0/weights"].T + p["layers/0/biases"], 0)
        of_input = x @ p["layers/1/weights_input"].T + p["layers/1/biases_input"]
        of_state = state @ p["layers/1/weights_hidden"].T + p["layers/1/biases_hidden"]
        gates = 1 / (1 + np.exp(-(of_input + of_state)[:, : 2 * units]))
        reset, update = gates[:, :units], gates[:, units:]
        candidate = np.tanh(of_input[:, 2 * units :] + reset * of_state[:, 2 * units :])
        state = (1 - update) * candidate + update * state
        given.append(state @ p["layers/2/weights"].T + p["layers/2/biases"])
    return np.stack(given)


def parameters_of(policy: Policy) -> Parameters:
    """The parameters of a policy that was trained in RAPTOR's form.

    Raises:
        ValueError: for a policy of any other form, naming what differs, its value and what is accepted; and for one
            whose graph computes something else with these parameters.
    """
    contract = policy.contract
    check_form(contract.observation, contract.control_rate_hz, contract.action.mode)
    graph = onnx.load_model_from_string(policy.content).graph
    constants = {tensor.name: numpy_helper.to_array(tensor) for tensor in graph.initializer}
    found = {name: constants[held].T for name, held in CONSTANTS.items() if held in constants}
    for name in found:
        if name.startswith("layers/1") and found[name].shape == SHAPES[name]:
            found[name] = other_gates(found[name])
    found["layers/1/initial_hidden_state"] = np.zeros(UNITS, np.float32)
    check_parameters(found)
    parameters = {name: np.ascontiguousarray(found[name], np.float32) for name in SHAPES}
    _check_agreement(policy, parameters)
    return parameters


def _check_agreement(policy: Policy, parameters: Parameters) -> None:
    """Fly both through the same random observations."""
    rng, steps, n = np.random.default_rng(0), 20, 50
    shown = rng.normal(size=(steps, n, policy.contract.observation_size)).astype(np.float32)
    turned = policy.contract.slices["attitude"]
    shown[..., turned] /= np.linalg.norm(shown[..., turned], axis=-1, keepdims=True)
    memory, acted = None, []
    for observation in shown:
        action, memory = policy.act(observation, memory=memory)
        acted.append(action)
    off = np.abs(np.stack(acted) - np.clip(commands(parameters, inputs_of(shown))[..., list(ROTOR_OF)], -1, 1)).max()
    if not off <= AGREES:
        raise ValueError(
            f"its graph computes something else than RAPTOR's form does with its weights: commands differ by "
            f"{off:.2g}; accepted: at most {AGREES:g}, as of a policy that was trained with network.form 'raptor'"
        )
