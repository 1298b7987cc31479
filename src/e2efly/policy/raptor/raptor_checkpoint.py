"""Checkpoints of RLtools that hold a policy of RAPTOR's form: the tar that PX4's `mc_raptor` reads, and the HDF5 file
of the Python package `foundation-policy`.

In a tar, a group is a path: each array of a group is NAME/data, its numbers in the order of the rows, float32 and
little-endian, beside NAME/meta, lines of text that say its shape. A group's own attributes are its meta. As RLtools
writes it (rl-tools at 9acdf5c8, include/rl_tools/persist/backends/tar, nn/layers/*/persist.h and
src/nn_models/port_checkpoint/raptor/main.cpp, read 2026-11-29).

Both hold an example: a sequence of inputs and the outputs that belong to them. PX4 runs the first five steps of its two
rows at every start, and refuses the checkpoint if the outputs differ by 1e-5 or more on average. The package runs all
of it, and accepts 1e-6.
"""

import io
import tarfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from e2efly.config.storage import write_atomically
from e2efly.policy.loader import Policy
from e2efly.policy.raptor import HDF5, TAR
from e2efly.policy.raptor.raptor_form import INPUTS
from e2efly.policy.raptor.raptor_network import SHAPES, Parameters, check_parameters, commands, parameters_of

EXAMPLE = 500, 2, INPUTS
"""Shape of the example's inputs: steps, rows, inputs. PX4 compiles it in."""
NAMED = 99
"""Largest length of the checkpoint's name: PX4 keeps a hundred characters."""
ATTRIBUTES: dict[str, dict[str, str]] = {
    "layers/0": {"activation_function": "RELU", "type": "dense"},
    "layers/1": {"type": "gru"},
    "layers/2": {"activation_function": "IDENTITY", "type": "dense"},
}
"""The attributes of each layer."""
META = (
    '{"environment": {"name": "l2f","observation": '
    '"Position.OrientationRotationMatrix.LinearVelocity.AngularVelocityDelayed(0).ActionHistory(1)"}}'
)
"""What the network sees, in RLtools' words, as in the published checkpoint."""


def write_checkpoint(path: Path, policy: Policy, name: str) -> None:
    """Write a policy of RAPTOR's form as a checkpoint, atomically: a .tar for PX4, a .h5 for `foundation-policy`.

    Args:
        path: the file to write.
        policy: the policy.
        name: name of the checkpoint, which PX4 shows.

    Raises:
        ValueError: for a policy of any other form, for a name that PX4 cannot hold, and for another kind of file.
        OSError: when the file cannot be written.
    """
    if path.suffix not in (TAR, HDF5):
        raise ValueError(f"--raptor is {str(path)!r}; accepted: a name that ends with {TAR} (PX4) or {HDF5} (Python)")
    if not (name.isascii() and name.isprintable() and 0 < len(name) <= NAMED):
        raise ValueError(f"--name is {name!r}; accepted: 1 to {NAMED} printable ASCII characters")
    parameters = parameters_of(policy)
    inputs = np.random.default_rng(0).normal(size=EXAMPLE).astype(np.float32)
    example = {"input": inputs, "output": commands(parameters, inputs)}
    write = _tar if path.suffix == TAR else _hdf5
    write_atomically(path, write(parameters, example, name))


def read_checkpoint(path: Path) -> Parameters:
    """The parameters of a checkpoint, of PX4's kind (.tar) or the Python package's (.h5).

    Raises:
        ValueError: naming the file, and what it lacks or has in another shape.
    """
    read = {TAR: _of_tar, HDF5: _of_hdf5}.get(path.suffix)
    if read is None:
        raise ValueError(f"{path}: accepted: a checkpoint of RAPTOR's form, {TAR} or {HDF5}")
    try:
        found = read(path)
        for name, shape in SHAPES.items():  # RLtools' older files hold biases as matrices of one row
            if name in found and found[name].size == np.prod(shape):
                found[name] = found[name].reshape(shape).astype(np.float32)
        check_parameters(found)
        if found["layers/1/initial_hidden_state"].any():
            raise ValueError("layers/1/initial_hidden_state is not zero; accepted: zeros")
    except (OSError, KeyError, ValueError, tarfile.TarError) as error:
        raise ValueError(f"{path}: {error}") from None
    return found


def _tar(parameters: Parameters, example: Parameters, name: str) -> bytes:
    """PX4's file. The entries stand in the order in which RLtools writes them."""
    entries = {"actor/meta": _lines({"checkpoint_name": name, "type": "sequential"})}
    for layer, attributes in ATTRIBUTES.items():
        for path, array in parameters.items():
            if path.startswith(layer):
                entries |= _tensor(f"actor/{path}/parameters", array) | {f"actor/{path}/meta": b""}
        entries[f"actor/{layer}/meta"] = _lines(attributes)
    for path, array in example.items():
        entries |= _tensor(f"example/{path}", array)
    content = io.BytesIO()
    with tarfile.open(fileobj=content, mode="w", format=tarfile.USTAR_FORMAT) as tar:
        for path, value in entries.items():
            about = tarfile.TarInfo(path)
            about.size = len(value)
            tar.addfile(about, io.BytesIO(value))
    return content.getvalue()


def _tensor(path: str, array: np.ndarray) -> dict[str, bytes]:
    """The entries of an array."""
    shape = {f"dim_{i}": size for i, size in enumerate(array.shape)}
    about = {"type": "tensor", "dtype": "float32", "num_dims": array.ndim, **shape}
    return {f"{path}/meta": _lines(about), f"{path}/data": array.astype("<f4").tobytes()}


def _lines(attributes: Mapping[str, Any]) -> bytes:
    return "".join(f"{name}: {value}\n" for name, value in attributes.items()).encode()


def _of_tar(path: Path) -> dict[str, np.ndarray]:
    with tarfile.open(path) as tar:
        files = {member.name: tar.extractfile(member) for member in tar.getmembers() if member.isfile()}
        content = {name: file.read() for name, file in files.items() if file is not None}
    found = {}
    for name in SHAPES:
        where = f"actor/{name}/parameters"
        if f"{where}/meta" in content and f"{where}/data" in content:
            about = dict(line.split(": ", 1) for line in content[f"{where}/meta"].decode("ascii").splitlines())
            if about.get("dtype") != "float32":
                raise ValueError(f"{name} has dtype {about.get('dtype')}; accepted: float32")
            shape = [int(about[f"dim_{i}"]) for i in range(int(about["num_dims"]))]
            found[name] = np.frombuffer(content[f"{where}/data"], "<f4").reshape(shape)
    return found


def _hdf5(parameters: Parameters, example: Parameters, name: str) -> bytes:
    """The Python package's file, laid out as its published checkpoint."""
    content = io.BytesIO()
    with _h5py().File(content, "w") as file:
        actor = file.create_group("actor")
        actor.attrs.update({"checkpoint_name": name, "meta": META, "type": "sequential"})
        for path, array in parameters.items():
            actor[f"{path}/parameters"] = array
        for layer, attributes in ATTRIBUTES.items():
            actor[layer].attrs.update(attributes)
        for path, array in example.items():
            file[f"example/{path}"] = array
    return content.getvalue()


def _of_hdf5(path: Path) -> dict[str, np.ndarray]:
    with _h5py().File(path) as file:
        places = {name: f"actor/{name}/parameters" for name in SHAPES}
        return {name: np.asarray(file[where]) for name, where in places.items() if where in file}


def _h5py() -> Any:
    try:
        import h5py
    except ImportError:
        raise ValueError("h5py is missing, which HDF5 files need; accepted: pip install 'e2efly[raptor]'") from None
    return h5py
