"""The policies that a training went through."""

from pathlib import Path

import numpy as np
import pytest

from e2efly.learning import history
from e2efly.runs.rundir import RunDirectory


@pytest.mark.parametrize("chunks", [1, 40, 64, 65, 1000])
def test_a_training_of_any_length_keeps_a_bounded_number_at_even_distances(chunks: int) -> None:
    chunk = 5
    updates = chunks * chunk
    kept = [u for u in range(chunk, updates + 1, chunk) if history.is_kept(u, chunk, updates)]
    assert kept[-1] == updates
    assert min(chunks, history.MOST // 2) <= len(kept) <= history.MOST + 1
    assert len(set(np.diff(kept[:-1]))) <= 1


def test_a_policy_is_found_again(tmp_path: Path) -> None:
    weights = {"head": [(np.ones((3, 2), np.float32), np.zeros(2, np.float32))]}
    for update in (10, 20, 30):
        scaled = {"head": [(update * weights["head"][0][0], weights["head"][0][1])]}
        history.keep(tmp_path / "history", update, scaled, 0.5)
    assert history.kept(tmp_path / "history") == [10, 20, 30]
    assert history.policy_at(tmp_path / "history", 20, weights)["head"][0][0][0, 0] == 20
    RunDirectory(tmp_path).forget_after(20)
    assert history.kept(tmp_path / "history") == [10, 20]


def test_a_policy_of_another_network_is_refused(tmp_path: Path) -> None:
    history.keep(tmp_path, 1, {"head": np.zeros(3, np.float32)}, 0.0)
    with pytest.raises(ValueError, match="accepted"):
        history.policy_at(tmp_path, 1, {"head": np.zeros(4, np.float32)})
