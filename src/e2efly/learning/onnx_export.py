"""Export a policy: features, network and squashing as one ONNX graph that carries its contract."""

from pathlib import Path
from typing import Any

import jax
import numpy as np
import onnx
from onnx import helper

from e2efly import __version__
from e2efly.config import TrainConfig
from e2efly.config.storage import write_atomically
from e2efly.control import COMMAND_MODES
from e2efly.environment import Env
from e2efly.environment.limits import limits_of, nominal_latency, posterior_of, sensing_of, vehicles_of
from e2efly.learning.networks import FAINTEST, NEAREST, Actor, View, Weights
from e2efly.learning.onnx_layers import policy_graph
from e2efly.learning.raptor_actor import actor_of
from e2efly.policy.contract import CONTRACT_VERSION, METADATA_KEY, Action, Contract
from e2efly.policy.images import NONE, Image
from e2efly.policy.onnx_file import sealed
from e2efly.policy.onnx_graph import IR_VERSION, OPSET
from e2efly.policy.onnx_session import remember
from e2efly.tasks import TASKS
from e2efly.vehicles.family import load_family, nominal_vehicle
from e2efly.vehicles.vehicle import quantities, terms


def contract_of(env: Env, config: TrainConfig) -> Contract:
    """The contract of a policy of this environment.

    Args:
        env: the environment that the policy was trained in.
        config: configuration of the run. `env` was built from its field `env`, which has the exact numbers.

    Raises:
        ValueError: when `env` was not built from `config.env` and the current vehicle file, naming the field.
    """
    about, physics = config.env, env.physics
    vehicle, family = nominal_vehicle(about.vehicle), load_family(about.vehicle)
    mode = COMMAND_MODES[about.command_mode].of(vehicle.rotor_count)
    rate = vehicle.control_rate if about.control_rate is None else about.control_rate
    low, high = limits_of(about, vehicle, family)
    _same("command_mode", physics.command_mode, mode.name)
    _same("control_period", physics.control_period, 1 / rate)
    for name in (field.name for field in (*quantities(), *terms())):
        _same(f"vehicle {vehicle.name}: {name}", getattr(physics.nominal, name), getattr(vehicle, name))
    _same("position_range (centre of the commands)", env.center, (low + high) / 2)
    _same("position_range (half range of the commands)", env.half, (high - low) / 2)
    if env.family != family:
        raise ValueError(f"family of the environment is {env.family}; its configuration says {family}")
    if env.cameras != about.cameras:
        raise ValueError(f"cameras of the environment are {env.cameras}; its configuration says {about.cameras}")
    actor = actor_of(env.fields, env.cameras, config.network)
    latency = _decimals(env.latency_range)
    limits = (tuple(map(float, low)), tuple(map(float, high)))
    courses = config.task.domain()
    return Contract(
        contract_version=CONTRACT_VERSION,
        e2efly_version=__version__,
        task=TASKS.reference(type(config.task)),
        vehicle=vehicle.name,
        vehicle_hash=vehicle.hash if family is None else None,
        vehicle_ranges=None if family is None else family.ranges,
        vehicles=None if family is not None else vehicles_of(about, vehicle, posterior_of(about)),
        control_rate_hz=float(rate),
        latency_s=nominal_latency(float(vehicle.latency), latency),
        latency_range_s=latency,
        observation_latency_range_s=_decimals(env.observation_latency_range),
        observation=env.fields,
        images=images_of(actor, float(rate)),
        memory_size=config.network.recurrent,
        action=Action(mode.name, mode.fields, mode.units, *limits),
        hover_action=_decimals(env.hover),
        courses=None if courses is None else (*courses, *config.env.payload.domain()),
        sensing=sensing_of(about, latency, float(rate)),
        others=getattr(env.task, "company", None),
    )


def images_of(actor: Actor, control_rate: float) -> tuple[Image, ...]:
    """The images of a policy as described in the contract, for a policy called at this control rate, Hz."""
    return tuple(_image(f"image_{i}", view, control_rate) for i, view in enumerate(actor.features.views))


def _image(name: str, view: View, control_rate: float) -> Image:
    c = view.camera
    ends = f"; 0: a hole, or nearer than {c.reach[0]:g} m; {c.reach[1]:g}: that far or farther"
    shows = {
        "depth": f"depth along the optical axis, m{ends}",
        "range": f"distance, m{ends}",
        "mask": f"1 where {c.of} is seen, else 0",
        "rgb": "red, green, blue in [0, 1]",
        "normal": "outward normal of the surface that is seen, world; 0, 0, 0: nothing",
    }
    done = []
    if view.measures:
        taken = {
            "inverse": f"1 m over it, less 1 m over {c.reach[1]:g} m",
            "log": f"logarithm of {c.reach[1]:g} m over it",
            "linear": f"1 less its share of {c.reach[1]:g} m",
        }
        done.append(f"{taken[c.encoding]}; nearer than {NEAREST:g} m as there; a hole: 0, as the farthest")
    if not view.patches:
        how = "the largest of each cell of" if view.measures else "averaged to"
        done.append(f"{how} {view.rows} rows and {view.columns} columns")
    if c.sees == "mask":
        done.append(f"beside itself times {view.contrast:g} over (its norm plus {FAINTEST:g})")
    if view.patches:
        done.append(f"convolved in patches of side {', '.join(map(str, view.patches))}")
    return Image(
        name=name,
        sees=c.sees,
        of=c.of if c.sees == "mask" else NONE,
        width=c.width,
        height=c.height,
        projection=c.projection,
        fov_rad=_floats(c.fov),
        reach_m=_floats(c.reach),
        position_m=_floats(c.position),
        pitch_rad=float(c.pitch),
        rate_hz=control_rate if c.rate is None else float(c.rate),
        latency_range_s=_floats(c.latency),
        encoding=c.encoding if view.measures else NONE,
        pool=(view.rows, view.columns),
        description=shows[c.sees],
        preprocessing="inside the graph: " + "; ".join(done),
    )


def export_policy(path: Path, weights: Weights, actor: Actor, contract: Contract) -> None:
    """Write a policy as ONNX with its digest, atomically: float32 `observation` (n, o) -> `action` (n, c) in [-1, 1].

    A policy with cameras has one input `image_0`, ... for each camera: its image, (n, h, w) or (n, h, w, 3). A policy
    with a GRU also has `memory` (n, k) -> `next_memory` (n, k).

    Args:
        path: the file to write.
        weights: the learned weights.
        actor: the structure of the policy. The graph computes its features from the observation and the images.
        contract: the contract that is stored in the file.

    Raises:
        ValueError: naming what does not fit together: weights, actor or contract.
        OSError: when the file cannot be written.
    """
    images = images_of(actor, contract.control_rate_hz)
    for name, has, wanted in (
        ("observation", contract.observation, actor.features.fields),
        ("images", contract.images, images),
        ("memory_size", contract.memory_size, actor.network.recurrent),
    ):
        if has != wanted:
            raise ValueError(f"contract.{name} is {has}; accepted: that of the policy, {wanted}")
    _check(weights, actor, contract)
    graph = policy_graph(jax.tree.map(lambda x: np.asarray(x, np.float32), weights), actor, [i.name for i in images])
    write_policy(path, graph, contract)


def write_policy(path: Path, graph: onnx.GraphProto, contract: Contract, trusted: bool = True) -> None:
    """Write a graph with its contract and its digest, atomically. One that is not `trusted`, as it holds nodes of
    another program, is tried in a process of its own when it is first loaded.

    Raises:
        ValueError: for a graph that ONNX refuses.
        OSError: when the file cannot be written.
    """
    model = helper.make_model(
        graph,
        opset_imports=[helper.make_opsetid("", OPSET)],
        ir_version=IR_VERSION,
        producer_name="e2efly",
        producer_version=contract.e2efly_version,
    )
    helper.set_model_props(model, {METADATA_KEY: contract.to_json()})
    onnx.checker.check_model(model, full_check=True)
    content = sealed(model.SerializeToString())
    if trusted:
        remember(content)
    write_atomically(Path(path), content)


def _check(weights: Weights, actor: Actor, contract: Contract) -> None:
    """Check that every array has the shape that the policy needs and is finite."""
    wanted = _arrays(actor.init(np.random.default_rng(0), np.array(contract.hover_action)))
    has = _arrays(weights)
    if list(has) != list(wanted):
        raise ValueError(f"weights has the arrays {', '.join(has)}; accepted: {', '.join(wanted)}")
    for name, array in has.items():
        if array.shape != wanted[name].shape:
            raise ValueError(f"weights{name} has shape {array.shape}; accepted: {wanted[name].shape}")
        if not np.isfinite(array).all():
            raise ValueError(f"weights{name} is not finite; accepted: finite numbers (did the training diverge?)")


def _arrays(weights: Weights) -> dict[str, np.ndarray]:
    """The arrays by their path: .head[0][1] is the bias of the first layer of the head."""
    return {jax.tree_util.keystr(at): np.asarray(x) for at, x in jax.tree_util.tree_leaves_with_path(weights)}


def _same(name: str, has: Any, wanted: Any) -> None:
    """Check that two values are equal, up to the rounding of the environment's number type."""
    if has is None or wanted is None:
        same = has is wanted
    else:
        same = has == wanted if isinstance(wanted, str) else np.allclose(has, wanted, rtol=1e-6, atol=0.0)
    if not same:
        raise ValueError(f"{name} of the environment is {has}; its configuration and vehicle say {wanted}")


def _floats(values: Any) -> tuple[float, ...]:
    return tuple(float(value) for value in values)


def _decimals(values: Any) -> tuple[float, ...]:
    """The shortest decimal numbers that round to these values, so that 0.03 in float32 is written as 0.03."""
    return tuple(float(str(value)) for value in np.asarray(values))
