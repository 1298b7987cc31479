"""Runs side by side."""

import json
from pathlib import Path

import numpy as np
import pytest

from e2efly.cli import run
from e2efly.learn.comparison import Compared, differing, table
from e2efly.learn.rundir import RunDirectory
from e2efly.presets import preset


def a_run(folder: Path, success: list[float], seed: int, ended: bool = True) -> Path:
    """A run's folder with evaluations of such success, 1000 steps and 2 s apart."""
    import dataclasses

    where = RunDirectory(folder)
    where.create(dataclasses.replace(preset("hover", "bptt"), seed=seed))
    where.append([
        {"update": 5 * i, "steps": 1000 * i, "seconds": 2.0 * i, "eval/hover/success": x}
        for i, x in enumerate(success, 1)
    ])  # fmt: skip
    if ended:
        summary = {"shipped": {"update": 5, "hover": {"success": max(success)}}}
        where.write_json("summary.json", summary)
    return folder


def test_what_runs_differ_in_and_when_they_were_there(tmp_path: Path) -> None:
    quick = Compared.of(a_run(tmp_path / "a", [0.2, 0.995, 0.98], 0))
    slow = Compared.of(a_run(tmp_path / "b", [0.1, 0.4, 0.9], 3, ended=False))
    assert differing([quick, slow]) == {"seed": [0, 3]}
    assert quick.there == (2000, 4.0)
    assert slow.there is None
    first, second = table([quick, slow])
    assert first["seed"] == "0"
    assert first["to 99%"] == "0.00 M, 4 s"
    assert first["success"] == "99.5%"
    assert second["to 99%"] == "never"
    assert second["success"] == "has not ended"


def test_a_run_that_has_just_begun_has_no_curve(tmp_path: Path) -> None:
    begun = Compared.of(a_run(tmp_path / "a", [], 0, ended=False))
    assert begun.there is None
    assert table([begun])[0]["steps"] == "none"
    assert np.size(begun.steps) == 0


def test_the_command_draws_and_writes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    runs = [str(a_run(tmp_path / name, [0.1, 1.0], i)) for i, name in enumerate("abcdefgh")]
    out = tmp_path / "plots" / "compare.png"
    assert run(["compare", *runs, "--out", str(out), "--json", str(tmp_path / "table.json")]) == 0
    assert out.stat().st_size > 10_000
    assert len(json.loads((tmp_path / "table.json").read_text())["runs"]) == 8
    assert run(["compare", str(tmp_path / "nothing"), "--out", str(out)]) == 2
    assert "holds no run" in capsys.readouterr().err
