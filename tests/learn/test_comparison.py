"""Runs side by side."""

import json
from pathlib import Path

import numpy as np
import pytest

from e2efly.cli import run
from e2efly.learn.comparison import Compared, differing, table
from e2efly.learn.rundir import RunDirectory
from e2efly.presets import preset


def a_run(
    folder: Path,
    success: list[float],
    seed: int,
    ended: bool = True,
    stop_at: float | None = None,
    robust: bool = False,
) -> Path:
    """A run's folder with evaluations of such success, 1000 steps and 2 s apart."""
    import dataclasses

    where = RunDirectory(folder)
    config = preset("hover", "bptt", "robust" if robust else "nominal")
    where.create(dataclasses.replace(config, seed=seed, stop_at=stop_at))
    where.append([
        {"update": 5 * i, "steps": 1000 * i, "seconds": 2.0 * i, "eval/hover/success": x}
        for i, x in enumerate(success, 1)
    ])  # fmt: skip
    if ended:
        found = {"update": 5, "hover": {"success": max(success)}}
        summary = {"nominal": {"hover": {"success": 1.0}}, "shipped": found} if robust else {"shipped": found}
        summary |= {"reached_criterion": {"steps": 1500, "seconds": 3.0}} if stop_at else {}
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
    assert first["reached"] == "95% (vehicle of the file): 0.00 M, 4 s"
    assert first["success"] == "99.5% (vehicle of the file)"
    assert second["reached"] == "95% (vehicle of the file): never"
    assert second["success"] == "has not ended"


def test_a_criterion_is_the_runs_own_and_every_success_says_of_what(tmp_path: Path) -> None:
    """A race that was to stop at 95 % and did; a robust run that stays below 99 %."""
    stopped = Compared.of(a_run(tmp_path / "a", [0.2, 0.965], 0, stop_at=0.96))
    assert stopped.there == (1500, 3.0)  # as the run confirmed it, by other starts than those of its evaluations
    assert table([stopped])[0]["reached"] == "96% (vehicle of the file): 0.00 M, 3 s"
    robust = table([Compared.of(a_run(tmp_path / "b", [0.2, 0.975], 0, robust=True))])[0]
    assert robust["reached"] == "90% (random vehicles): 0.00 M, 4 s"
    assert robust["success"] == "100.0% (vehicle of the file), 97.5% (random vehicles)"


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
