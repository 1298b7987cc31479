"""The policies that a training went through, for those who watch it: weights alone, at even distances.

A run's folder `history` has a file of weights for an update, named by it. Which updates are kept depends on the
configuration alone, so that a run that was killed and resumed ends with the same files.
"""

from pathlib import Path
from typing import Any

from e2efly.learn.checkpoint import load_checkpoint, save_checkpoint
from e2efly.learn.networks import Weights

MOST = 64
"""Policies that are kept of a run, and perhaps a last one more."""
_SUFFIX = ".safetensors"


def is_kept(update: int, chunk: int, updates: int) -> bool:
    """Whether the policy after an update is kept.

    Args:
        update: how many updates there were.
        chunk: updates between two evaluations.
        updates: of the whole run.
    """
    apart = -(-(updates // chunk) // MOST)
    return update == updates or update // chunk % apart == 0


def keep(folder: Path, update: int, weights: Weights, success: float) -> None:
    """Write the policy after an update.

    Args:
        folder: `RunDirectory.history`; made where it is not there.
        update: its number.
        weights: of the policy.
        success: of its evaluation.

    Raises:
        OSError: when it cannot be written.
    """
    folder.mkdir(exist_ok=True)
    save_checkpoint(folder / f"{update:08d}{_SUFFIX}", weights, {"update": update, "success": success})


def kept(folder: Path) -> list[int]:
    """The updates of which policies are there, in order."""
    return sorted(int(path.stem) for path in folder.glob(f"*{_SUFFIX}") if path.stem.isdigit())


def policy_at(folder: Path, update: int, like: Any) -> Weights:
    """The policy after an update.

    Args:
        folder: of the run's history.
        update: one of `kept`.
        like: weights of the same shapes.

    Raises:
        ValueError: when the file is damaged, or of another network.
    """
    return load_checkpoint(folder / f"{update:08d}{_SUFFIX}", like)


def forget_after(folder: Path, update: int) -> None:
    """Delete the policies of updates that a resumed run will do again."""
    for number in kept(folder):
        if number > update:
            (folder / f"{number:08d}{_SUFFIX}").unlink()
