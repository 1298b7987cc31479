"""Load `policy.onnx` and act with it. Imports no JAX and no simulator, so that it starts fast on a companion computer.

The file is refused when it is damaged. It is also refused when it does not agree with its own contract, or with what
the caller is about to fly.
"""

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import onnxruntime as ort

from e2efly.policy.contract import METADATA_KEY, Contract
from e2efly.policy.onnx_file import METADATA, Message, check_seal, file_content, is_sealed, read, sealed, write
from e2efly.policy.onnx_graph import FLOAT, IR_VERSION, OPSET, TYPES, check
from e2efly.policy.onnx_session import open_session
from e2efly.policy.zoo import policy_file, shipped_name
from e2efly.vehicles.loading import load_vehicle, vehicle_names
from e2efly.vehicles.vehicle import Vehicle

INPUT, OUTPUT = "observation", "action"
"""Names of the graph's first input and of its output. The inputs for images have the names of the images."""
MEMORY, NEXT_MEMORY = "memory", "next_memory"
"""Names of the input and the output of a policy with memory."""
UNIT_TOLERANCE = 0.01
"""Largest deviation of the length of the attitude quaternion from 1."""
ROUNDING = 1e-6
"""Largest amount by which an action or a memory may exceed 1: ONNX Runtime's tanh reaches 1.0000001."""
_LARGEST = np.finfo(np.float32).max


@dataclass(frozen=True)
class Policy:
    """A checked policy, which runs on one thread. Create it with `load_policy`."""

    contract: Contract
    """What it sees and commands."""
    session: ort.InferenceSession
    """The loaded graph."""
    content: bytes = b""
    """What was checked and loaded: the file, without remarks. Whatever else reads the graph reads this."""

    def act(
        self, observation: np.ndarray, images: Sequence[np.ndarray] = (), memory: np.ndarray | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """The actions for observations and images, and the memory for the next call.

        Args:
            observation: shape (o,) or (n, o), laid out as `contract.observation` says, in its units and frames.
            images: as `contract.images` says, in that order; shape (h, w) or (n, h, w), for colours (..., h, w, 3).
            memory: what the last call returned, (k,) or (n, k); None at the start of a flight.

        Returns:
            The action, float32 in [-1, 1], shape (c,) or (n, c); and the memory for the next call, (k,) or (n, k), with
            k = 0 if `contract.memory_size` is 0.

        Raises:
            ValueError: naming the observation field or the image, for a wrong shape, for a number that is not finite
                or is out of range, and for an attitude that is not a unit quaternion. Also for an observation so large
                that the network overflows.
        """
        x = np.asarray(observation)
        self._check(x)
        lead = x.shape[:-1]
        fed = {INPUT: x} | self._seen(images, lead)
        size = self.contract.memory_size
        known = np.zeros((*lead, size), np.float32) if memory is None else self._remembered(memory, lead)
        if size:
            fed[MEMORY] = known
        batches = {name: np.ascontiguousarray(v if lead else v[None], np.float32) for name, v in fed.items()}
        action, *after = (np.asarray(y) for y in self.session.run([OUTPUT, *([NEXT_MEMORY] if size else [])], batches))
        good = np.abs(action) <= 1 + ROUNDING  # false for NaN
        if not good.all():
            row = int(np.argmin(good.all(-1)))
            raise ValueError(
                f"action is {action[row].tolist()} for the observation {batches[INPUT][row].tolist()}; accepted: "
                "numbers in [-1, 1]; the observation is far outside of what flies, or the policy file is damaged"
            )
        action = np.minimum(np.maximum(action, -1), 1)
        if size:
            known = after[0] if lead else after[0][0]
        return action if lead else action[0], known

    def command(self, action: np.ndarray) -> np.ndarray:
        """The commands for actions, shape (c,) or (n, c), in `contract.action.units`. Actions are clipped to [-1, 1].

        Raises:
            ValueError: for a wrong shape or a non-finite number.
        """
        a, size = np.asarray(action, np.float64), self.contract.action.size
        if a.ndim not in (1, 2) or a.shape[-1] != size:
            raise ValueError(f"action has shape {a.shape}; accepted: ({size},) or (n, {size})")
        if not np.isfinite(a).all():
            raise ValueError(f"action is {a.tolist()}; accepted: finite numbers")
        return self.contract.action.command(a)

    def _seen(self, images: Sequence[np.ndarray], lead: tuple[int, ...]) -> dict[str, np.ndarray]:
        """The images by name, checked."""
        wanted = self.contract.images
        if len(images) != len(wanted):
            layout = ", ".join(f"{image.name!r} {image.shape}" for image in wanted) or "none"
            raise ValueError(f"{len(images)} images; accepted: {len(wanted)}: {layout}")
        seen = {image.name: np.asarray(x) for image, x in zip(wanted, images, strict=True)}
        for image in wanted:
            image.check(seen[image.name], lead)
        return seen

    def _remembered(self, memory: np.ndarray, lead: tuple[int, ...]) -> np.ndarray:
        """The memory, checked."""
        m, shape = np.asarray(memory), (*lead, self.contract.memory_size)
        if m.shape != shape or m.dtype.kind not in "fiu":
            raise ValueError(f"memory has shape {m.shape} and type {m.dtype}; accepted: float32 of shape {shape}")
        if not (np.abs(m) <= 1 + ROUNDING).all():  # false for NaN
            raise ValueError(f"memory is {m.tolist()}; accepted: numbers in [-1, 1], as `act` returned them")
        return m

    def _check(self, x: np.ndarray) -> None:
        """Refuse an observation that the network must not see. The check is fast, because it runs at every control
        step.
        """
        slices = self.contract.slices
        if x.ndim not in (1, 2) or x.shape[-1] != self.contract.observation_size or x.dtype.kind not in "fiu":
            raise ValueError(_wrong_shape(self.contract, x))
        good = np.abs(x) <= _LARGEST  # false for NaN, infinity and what float32 cannot hold
        if not good.all():
            name = next(name for name, part in slices.items() if not good[..., part].all())
            raise _refusal(name, x[..., slices[name]], np.all(good[..., slices[name]], -1), "finite numbers")
        attitude = x[..., slices[self.contract.attitude]]
        square = np.square(attitude, dtype=np.float64).sum(-1)
        unit = np.asarray(np.abs(square - 1) <= 2 * UNIT_TOLERANCE)
        if not unit.all():
            raise _refusal(self.contract.attitude, attitude, unit, "a unit quaternion wxyz, body to world")


def load_policy(
    policy: str | os.PathLike[str],
    *,
    task: str | None = None,
    vehicle: Vehicle | str | Path | None = None,
    control_rate_hz: float | None = None,
    command_mode: str | None = None,
) -> Policy:
    """Load a policy. Check it against its contract, and against what it is going to fly.

    Args:
        policy: a `policy.onnx`, a run directory, or a name of the zoo: a task, or as in `any/hover`.
        task: name of the task that will be flown.
        vehicle: the vehicle that will fly: its name, the path of its .toml file, or the loaded vehicle.
        control_rate_hz: the rate at which the policy will be called, Hz.
        command_mode: the command mode of the flight controller.

    Raises:
        ValueError: naming the file and the field, its value, the expected value, and what to do. Omitted arguments are
            not compared.
    """
    if vehicle is not None and not isinstance(vehicle, Vehicle):
        vehicle = load_vehicle(vehicle)
    path = policy_file(policy, vehicle.name if vehicle and vehicle.name in vehicle_names() else None)
    loaded = _policy(str(path), _read(path))
    contract = loaded.contract
    reasons = contract.refusals(vehicle, control_rate_hz)
    for name, value, own in (("task", task, contract.task), ("command_mode", command_mode, contract.action.mode)):
        if value is not None and value != own:
            reasons += (f"{name} is {value!r}; accepted: {own!r}, for which the policy was trained",)
    if reasons:
        raise ValueError(f"{path}: {'; '.join(reasons)}")
    return loaded


def sealed_policy(path: str | Path) -> bytes:
    """The content of a policy's file with its digest, for a file of an older e2efly, which has no digest.

    Raises:
        ValueError: naming the file, if it cannot be loaded even with a digest, or if it already has one.
    """
    content = _read(path)
    if is_sealed(content):
        raise ValueError(f"{path}: has a digest already; accepted: a policy.onnx of an older e2efly, without one")
    content = sealed(content)
    _policy(str(path), content)
    return content


def _read(path: str | Path) -> bytes:
    try:
        return file_content(path)
    except ValueError as error:
        raise ValueError(f"{path}: {error}; accepted: the path of a policy.onnx") from None


def _policy(where: str, content: bytes) -> Policy:
    """The policy of a file, checked against its own contract."""
    try:
        check_seal(content)
        model = read(content)
        _check_model(model)
        contract = _contract(model)
        inputs, outputs = _check_interface(model["graph"], contract)
        check(model["graph"], inputs, outputs, contract.control_rate_hz)
        checked = write(model)
        level, images = level_and_still(contract), [np.zeros(image.shape, np.float32) for image in contract.images]
        tried = [level, *images, *([np.zeros(contract.memory_size, np.float32)] if contract.memory_size else [])]
        session = open_session(checked, [x[None] for x in tried], trusted=shipped_name(content) is not None)
    except ValueError as error:
        raise ValueError(f"{where}: {error}") from None
    policy = Policy(contract, session, checked)
    try:  # also warms the session up
        policy.act(level, images)
    except Exception as error:  # ONNX Runtime's errors share no other base
        raise ValueError(f"{where}: does not run on the observation of a level, still vehicle: {error}") from None
    return policy


def _check_model(model: Message) -> None:
    operators = [(entry.get("domain", ""), entry.get("version")) for entry in model.get("opset_import", [])]
    if operators != [("", OPSET)] or model.get("ir_version") != IR_VERSION:
        raise ValueError(
            f"has operators of the versions {operators!r:.200} in the format {model.get('ir_version')}; accepted: "
            f"operators of ONNX's version {OPSET} in the format {IR_VERSION}, as `e2efly export` writes them"
        )
    if "graph" not in model:
        raise ValueError("not an ONNX file: it has no graph; accepted: a file as `e2efly export` writes it")


def _contract(model: Message) -> Contract:
    found = [entry.get("value", "") for entry in model.get(METADATA, []) if entry.get("key") == METADATA_KEY]
    if len(found) != 1:
        raise ValueError(
            f"metadata key {METADATA_KEY!r} is {'there twice' if found else 'missing'}; accepted: an ONNX file with "
            "its contract, as `e2efly export` writes it"
        )
    return Contract.from_json(found[0])


def level_and_still(contract: Contract) -> np.ndarray:
    """An observation, shape (o,), with a level attitude, a heading along world x, and zeros elsewhere."""
    observation = np.zeros(contract.observation_size, np.float32)
    observation[contract.slices[contract.attitude].start] = 1.0
    return observation


def _check_interface(
    graph: Message, contract: Contract
) -> tuple[dict[str, tuple[int, ...]], dict[str, tuple[int, ...]]]:
    """Check for float32 inputs and outputs with the names and sizes of the contract, and a free batch axis. Returns
    their names and shapes without that axis.
    """
    remembers = next((axes[-1] for name, _, axes in _declared(graph, "input") if name == MEMORY and axes), 0)
    if remembers != contract.memory_size:
        raise ValueError(
            f"memory_size is {contract.memory_size} in the contract; accepted: {remembers}, the numbers of "
            "memory that its graph has; export the policy again with this e2efly"
        )
    inputs: dict[str, tuple[int, ...]] = {INPUT: (contract.observation_size,)}
    inputs |= {image.name: image.shape for image in contract.images}
    outputs: dict[str, tuple[int, ...]] = {OUTPUT: (contract.action.size,)}
    if contract.memory_size:
        inputs[MEMORY] = outputs[NEXT_MEMORY] = (contract.memory_size,)
    for side, wanted in (("input", inputs), ("output", outputs)):
        has = _declared(graph, side)
        free = [(name, kind, [axis if isinstance(axis, int) else "n" for axis in axes[:1]] + axes[1:])
                for name, kind, axes in has]  # fmt: skip
        said = [(name, FLOAT, ["n", *shape]) for name, shape in wanted.items()]
        if free != said:
            raise ValueError(f"{side} of the graph is {has!r:.500}; its contract says {said}; export the policy again")
    return inputs, outputs


def _declared(graph: Message, side: str) -> list[tuple[str, str, list[int | str]]]:
    """Name, type and axes of the inputs or outputs that the graph declares."""
    found = []
    for value in graph.get(side, []):
        tensor = value.get("type", {}).get("tensor_type", {})
        number = tensor.get("elem_type", 0)
        kind = TYPES.get(number, f"type {number}")
        axes = [axis.get("dim_value", axis.get("dim_param", "?")) for axis in tensor.get("shape", {}).get("dim", [])]
        found.append((value.get("name", ""), kind, axes))
    return found


def _refusal(name: str, part: np.ndarray, good: np.ndarray, accepted: str) -> ValueError:
    """The error. It names the field and the first invalid row of a batch."""
    row = int(np.argmin(good))
    where = "observation" if part.ndim == 1 else f"observation[{row}]"
    return ValueError(f"{where}: field {name!r} is {np.atleast_2d(part)[row].tolist()}; accepted: {accepted}")


def _wrong_shape(contract: Contract, x: np.ndarray) -> str:
    """What is wrong with the shape, and the field in which a vector of this length ends."""
    size = contract.observation_size
    layout = ", ".join(f"{field.name} {field.size}" for field in contract.observation)
    accepted = f"float32 of shape ({size},) or (n, {size}): {layout}"
    text = f"observation has shape {x.shape} and type {x.dtype}; accepted: {accepted}"
    count = x.shape[-1] if x.ndim else 0
    if count > size:
        return f"{text}; {count - size} too many after field {contract.observation[-1].name!r}"
    if count < size:
        return f"{text}; it breaks off in field {next(n for n, s in contract.slices.items() if s.stop > count)!r}"
    return text
