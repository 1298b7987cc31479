"""An exported policy, compiled by the system's compiler and asked from Python."""

import ctypes
import shutil
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from e2efly.policy.c_export.header import Precision, Sizes
from e2efly.policy.c_export.write import write_c
from e2efly.policy.contract import Contract
from e2efly.policy.loader import load_policy

STRICT = ("-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-Wconversion")


def compiler(name: str = "cc") -> str:
    if not (found := shutil.which(name)):
        pytest.fail(f"needs {name} (Debian: apt-get install gcc g++); or E2EFLY_WITHOUT=cc to go without")
    return found


def build(out: Path, *arguments: object, name: str = "cc") -> Path:
    done = subprocess.run([compiler(name), *map(str, arguments), "-o", str(out)], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return out


@dataclass(frozen=True)
class Compiled:
    contract: Contract
    needs: Sizes
    library: ctypes.CDLL
    state: np.ndarray
    """Its bytes: memory first, then past actions, observation and scratch."""

    @property
    def memory(self) -> np.ndarray:
        """The part of the state that is the network's memory."""
        return self.state.view(np.float32)[: self.contract.memory_size]

    def network(self, observation: np.ndarray, images: Sequence[np.ndarray] = ()) -> tuple[int, np.ndarray]:
        return self._call(self.library.policy_network, observation, images)

    def act(self, seen: np.ndarray, images: Sequence[np.ndarray] = ()) -> tuple[int, np.ndarray]:
        """Status and action of what is seen, past actions left out."""
        return self._call(self.library.policy_act, seen, images)

    def begin(self) -> None:
        self.library.policy_begin(pointer(self.state))

    def command(self, action: np.ndarray) -> np.ndarray:
        out = np.empty(self.contract.action.size, np.float32)
        self.library.policy_command(pointer(np.ascontiguousarray(action, np.float32)), pointer(out))
        return out

    def _call(self, function: Any, seen: np.ndarray, images: Sequence[np.ndarray]) -> tuple[int, np.ndarray]:
        action = np.full(self.contract.action.size, 9.0, np.float32)
        given = [np.ascontiguousarray(x, np.float32) for x in (seen, *images)]
        status = function(pointer(self.state), *map(pointer, given), pointer(action))
        return status, action


def pointer(x: np.ndarray) -> ctypes.c_void_p:
    return x.ctypes.data_as(ctypes.c_void_p)


def compiled(file: Path, folder: Path, precision: Precision = "double", *flags: str) -> Compiled:
    needs = write_c(folder, file, "policy", precision)
    library = build(folder / "policy.so", *(flags or ("-O2",)), *STRICT, "-shared", "-fPIC", folder / "policy.c", "-lm")
    state = np.zeros(needs.state // 8 + 1).view(np.uint8)
    return Compiled(load_policy(file).contract, needs, ctypes.CDLL(str(library)), state)
