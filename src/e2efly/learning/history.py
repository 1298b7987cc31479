"""Policies from the course of a training, for viewing it: only weights, at regular intervals.

The folder `history` of a run holds one file of weights per kept update, named by the number of the update. Which
updates are kept depends only on the configuration. A run that was killed and resumed therefore ends with the same
files.
"""

from pathlib import Path
from typing import Any

from e2efly.learning.checkpoint import load_checkpoint, save_checkpoint
from e2efly.learning.networks import Weights

MOST = 64
"""Largest number of policies that are kept of a run. The last policy can be one more."""
_SUFFIX = ".safetensors"


def is_kept(update: int, chunk: int, updates: int) -> bool:
    """Whether the policy after an update is kept.

    Args:
        update: number of updates so far.
        chunk: updates between two evaluations.
        updates: updates of the whole run.
    """
    apart = -(-(updates // chunk) // MOST)
    return update == updates or update // chunk % apart == 0


def keep(folder: Path, update: int, weights: Weights, success: float) -> None:
    """Write the policy after an update.

    Args:
        folder: `RunDirectory.history`. It is created if it does not exist.
        update: number of the update.
        weights: weights of the policy.
        success: success rate in the evaluation of the policy.

    Raises:
        OSError: when the file cannot be written.
    """
    folder.mkdir(exist_ok=True)
    save_checkpoint(folder / f"{update:08d}{_SUFFIX}", weights, {"update": update, "success": success})


def kept(folder: Path) -> list[int]:
    """The updates whose policies were kept, in order."""
    return sorted(int(path.stem) for path in folder.glob(f"*{_SUFFIX}") if path.stem.isdigit())


def policy_at(folder: Path, update: int, like: Any) -> Weights:
    """The policy after an update.

    Args:
        folder: the folder of the run's history.
        update: one of the updates that `kept` returns.
        like: weights of the same shapes.

    Raises:
        ValueError: when the file is damaged, or belongs to another network.
    """
    return load_checkpoint(folder / f"{update:08d}{_SUFFIX}", like)
