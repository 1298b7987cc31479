"""A checkpoint of RAPTOR's form as a policy.onnx with its contract."""

from pathlib import Path

from e2efly.learning.onnx_export import contract_of, export_policy
from e2efly.learning.raptor_actor import weights_of
from e2efly.learning.setup import Setup
from e2efly.policy.raptor.raptor_checkpoint import read_checkpoint
from e2efly.runs.presets import preset

PRESET = "raptor"
"""The preset of hover whose environment, and so whose contract, an imported policy has."""


def import_checkpoint(file: Path, path: Path) -> None:
    """Write a checkpoint, of RLtools' tar or of the Python package's HDF5, as a policy.onnx.

    Its contract is that of the preset `raptor`: the file does not say which vehicles and delays it was trained for.

    Raises:
        ValueError: naming the file and what is wrong with it.
        OSError: when the file cannot be written.
    """
    weights = weights_of(read_checkpoint(file))
    config = preset("hover", "bptt", PRESET)
    setup = Setup.of(config)
    export_policy(path, weights, setup.actor, contract_of(setup.env, config))
