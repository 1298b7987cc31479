"""Start a training from the result of another one: the weights of a policy.onnx that e2efly has written."""

import dataclasses
from pathlib import Path
from typing import Any

import jax
import numpy as np
import onnx
from onnx import numpy_helper

from e2efly.config import ALGORITHMS, NetworkConfig
from e2efly.learning import raptor_actor
from e2efly.learning.checkpoint import read_arrays
from e2efly.learning.networks import Actor, Gru, Layers, Weights
from e2efly.learning.onnx_export import contract_of
from e2efly.learning.onnx_layers import OPERATORS
from e2efly.learning.setup import Setup
from e2efly.policy.contract import Contract
from e2efly.policy.loader import OUTPUT, Policy, load_policy
from e2efly.policy.raptor.raptor_network import parameters_of
from e2efly.runs.rundir import run_of


def started_from(parameters: Any, path: Path, setup: Setup) -> Any:
    """Parameters of an algorithm whose policy is read from a file.

    If the file is the policy.onnx of a run with the same algorithm, the other parameters (critics, noise of the
    actions) are those at the end of that run. Otherwise they are the initial ones of `init`. Optimisers always start
    anew.

    Args:
        parameters: the parameters from the algorithm's `init`. Every copy of the policy in them is replaced.
        path: a policy.onnx.
        setup: the run that will learn.

    Raises:
        ValueError: for a policy that cannot be loaded, that has other observation fields, images or commands, or whose
            network has other sizes, naming the file, what it has and what is accepted.
    """
    loaded = load_policy(path)
    has, wanted = _shape(loaded.contract), _shape(contract_of(setup.env, setup.config))
    for name, accepted in wanted.items():
        if (value := has.get(name)) != accepted:
            hint = "; did you mean --preset robust?" if name == "memory_size" and value and not accepted else ""
            raise ValueError(
                f"start_from {path}: its {name} is {value}; accepted: {accepted}, as this run's policy has{hint}"
            )
    if isinstance(setup.actor, raptor_actor.RaptorActor):
        try:
            weights = raptor_actor.weights_of(parameters_of(loaded))
        except ValueError as error:
            raise ValueError(f"start_from {path}: {error}") from None
    else:
        weights = weights_of(path, loaded.content, parameters.policy, setup.actor)
    copies = {
        field.name: weights
        for field in dataclasses.fields(parameters)
        if _same(getattr(parameters, field.name), parameters.policy)
    }
    return dataclasses.replace(_of_run(parameters, path, setup), **copies)


def _of_run(parameters: Any, path: Path, setup: Setup) -> Any:
    """The parameters at the end of the run that wrote the policy file. If there is no such run, or its parameters have
    another shape, `parameters`.
    """
    run = run_of(path)
    if run is None or not run.checkpoint.is_file():
        return parameters
    if run.read_json("config.json").get("algo_name") != ALGORITHMS.reference(type(setup.config.algo)):
        return parameters
    arrays = read_arrays(run.checkpoint)
    leaves, structure = jax.tree_util.tree_flatten_with_path(parameters)
    found = [arrays.get(f"['state'].parameters{jax.tree_util.keystr(where)}") for where, _ in leaves]
    if any(x is None or x.shape[1:] != np.shape(leaf) for x, (_, leaf) in zip(found, leaves, strict=True)):
        return parameters
    return jax.tree_util.tree_unflatten(structure, [x[0] for x in found if x is not None])  # every device has the same


def network_of(path: Path, loaded: Policy) -> NetworkConfig:
    """The options of the network in a policy's file, for a policy without images.

    Raises:
        ValueError: for a file that e2efly's training has not written, naming it.
    """
    graph = onnx.load_model_from_string(loaded.content).graph
    widths = {x.name: x.dims[-1] for x in graph.initializer}
    layers = [int(widths[name]) for i in range(len(widths)) if (name := f"weight_{i}") in widths]
    made = next((node.op_type for node in graph.node if "hidden_1" in node.output), None)
    activation: Any = next((name for name, operator in OPERATORS.items() if operator == made), None)
    if len(layers) < 2 or activation is None:
        raise ValueError(f"{path}: it has no hidden layers of e2efly; accepted: a policy that e2efly has trained")
    return NetworkConfig(tuple(layers[:-1]), activation, recurrent=loaded.contract.memory_size)


def weights_of(path: Path, content: bytes, like: Weights, actor: Actor) -> Weights:
    """Read the weights that `e2efly.learning.onnx_layers.policy_graph` has written, for a network like `like`.

    Raises:
        ValueError: for a network of other sizes or another activation, naming the file.
    """
    graph = onnx.load_model_from_string(content).graph
    constants = {x.name: numpy_helper.to_array(x) for x in graph.initializer}
    operators = {node.output[0]: node.op_type for node in graph.node}
    for output, wanted in (("hidden_1", OPERATORS[actor.network.activation]), (OUTPUT, "Tanh")):
        if operators.get(output) != wanted:
            raise ValueError(
                f"start_from {path}: {output} comes of {operators.get(output)}; accepted: {wanted}, as in a policy "
                f"that was trained by e2efly with network.activation {actor.network.activation}"
            )

    def taken(name: str, wanted: Any) -> np.ndarray:
        found = constants.get(name)
        if found is None or found.shape != np.shape(wanted):
            has = "is missing" if found is None else f"has shape {found.shape}"
            raise ValueError(f"start_from {path}: {name} {has}; accepted: {np.shape(wanted)}: use its network's sizes")
        return found

    def layers(like: Layers, prefix: str = "") -> Layers:
        return [
            (taken(f"{prefix}weight_{i}", weight), taken(f"{prefix}bias_{i}", bias))
            for i, (weight, bias) in enumerate(like)
        ]

    encoders = []
    for number, (view, each) in enumerate(zip(actor.features.views, like.encoders, strict=True)):
        kernels, channels = [], view.channels
        for i, (side, (weight, bias)) in enumerate(zip(view.patches, each, strict=False)):
            wider = np.shape(weight)[1]
            kernel = taken(f"image_{number}_kernel_{i}", np.empty((wider, channels, side, side)))
            flat = kernel.transpose(2, 3, 1, 0).reshape(np.shape(weight))
            kernels.append((flat, taken(f"image_{number}_kernel_bias_{i}", bias)))
            channels = wider
        encoders.append(kernels + layers(each[len(view.patches) :], f"image_{number}_"))
    cell = None
    if like.cell is not None:
        cell = Gru(**{name: taken(f"gru_{name}", value) for name, value in vars(like.cell).items()})
    head = layers(like.head)
    if f"weight_{len(head)}" in constants:
        raise ValueError(f"start_from {path}: it has more layers than {len(head)}; accepted: network.hidden as its own")
    return Weights(tuple(encoders), cell, head)


def _same(a: Any, b: Any) -> bool:
    if type(a) is not type(b):
        return False
    (these, shape), (those, other) = jax.tree.flatten(a), jax.tree.flatten(b)
    return shape == other and all(np.array_equal(x, y) for x, y in zip(these, those, strict=True))


def _shape(contract: Contract) -> dict[str, Any]:
    """The parts of a contract on which a network and its normalisation depend, by name. The position of a camera is not
    among them.
    """
    found: dict[str, Any] = {"observation": [field.name for field in contract.observation]}
    found |= {"number of images": len(contract.images), "memory_size": contract.memory_size}
    found |= {"command mode": contract.action.mode, "number of commands": contract.action.size}
    for parts, names in (
        (contract.observation, ("size", "frame", "scale")),
        (contract.images, ("sees", "of", "width", "height", "encoding", "pool", "preprocessing")),
    ):
        found |= {f"{part.name} {name}": getattr(part, name) for part in parts for name in names}
    return found
