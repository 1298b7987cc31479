"""The benchmark of policies: what is flown, what an interruption leaves, and what the card says."""

import dataclasses
import json
from pathlib import Path
from typing import Any

import pytest

from e2efly.commands import benchmark
from e2efly.commands.benchmark_card import page
from e2efly.commands.cli import run
from e2efly.config.storage import write_json
from e2efly.environment.episodes import wilson
from e2efly.runs import presets
from e2efly.runs.inputs import to_json
from e2efly.validation import evaluation, scorecard
from e2efly.validation.candidate import candidate
from e2efly.validation.scorecard import SEED, CardScale, Mean, entrant, parts_of, score
from e2efly.validation.stress_laws import LAWS
from tests.commands.test_cli import error_of
from tests.policy.made import made

pytestmark = pytest.mark.usefixtures("quick")

ROOT = Path(__file__).parents[2]


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    """A benchmark of few rows."""
    monkeypatch.setattr(scorecard, "LATENCIES", (0.0, 0.06))
    monkeypatch.setattr(scorecard, "LAWS", {name: LAWS[name] for name in ("delay walks",)})
    monkeypatch.setattr(scorecard, "rows_for", lambda cameras: ("nominal", "mass x1.25"))
    monkeypatch.setattr(scorecard, "ON_PLANTS", {"trained": ("nominal",), "untrained": ("delay walks",)})


def test_its_seed_is_of_no_other_figure() -> None:
    assert SEED != evaluation.SEED
    others = [file for file in (ROOT / "benchmarks" / "results").glob("*.json") if file.stem != "scorecards"]
    assert others
    assert not [file for file in others if f'"seed": {SEED},' in file.read_text(encoding="utf-8")]


def test_more_rows_from_the_same_starts_do_not_narrow_an_interval() -> None:
    def figures(success: float) -> dict[str, Any]:
        return {"episodes": 50, "success": success}

    rows = {"a": {"x": figures(1.0), "y": figures(0.9)}, "b": {"x": figures(0.6), "y": figures(1.0)}}
    mean = Mean.of(rows)  # a row counts as much as its worst criterion
    assert (mean.success, mean.worst, mean.lowest) == (0.75, "b", 0.6)
    assert mean.interval == wilson(37.5, 50)
    assert Mean.of({f"{name}{i}": row for name, row in rows.items() for i in range(9)}).interval == mean.interval


def test_an_interrupted_card_keeps_its_finished_parts(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    found, flown, kept = entrant(made(tmp_path / "x.onnx", 0.01)), list[str](), list[list[dict[str, Any]]]()

    def fly(_: Any, place: str, kind: str, episodes: int) -> dict[str, Any]:
        if len(flown) == 2:
            raise KeyboardInterrupt
        flown.append(f"{place} {kind} {episodes}")
        return {"rows": {}}

    monkeypatch.setattr(scorecard, "_flown", fly)
    with pytest.raises(KeyboardInterrupt):
        score(found, CardScale(4, 2), [], kept.append)
    assert flown == ["training latency 4", "training trained 4"]
    done = kept[-1]
    flown.clear()
    monkeypatch.setattr(scorecard, "_flown", lambda found, place, kind, n: flown.append(f"{place} {kind} {n}") or {})
    parts = score(found, CardScale(4, 2), done, kept.append)
    assert flown == ["training untrained 4", "mujoco trained 2", "mujoco untrained 2"]
    assert [(part["place"], part["kind"]) for part in parts] == [(x["place"], x["kind"]) for x in parts_of(CardScale())]
    flown.clear()
    score(found, CardScale(5, 2), parts, kept.append)
    assert [text.split()[-1] for text in flown] == ["5", "5", "5"]  # another scale, but not on the plant


def test_a_run_is_judged_in_the_preset_of_its_task_and_not_in_its_own_options(tmp_path: Path) -> None:
    config = presets.preset("hover", "ppo")
    easy = dataclasses.replace(config.task, radius=0.5)
    (tmp_path / "run").mkdir()
    made(tmp_path / "run" / "policy.onnx", 0.01)
    write_json(tmp_path / "run" / "config.json", to_json(dataclasses.replace(config, task=easy)))
    assert candidate(tmp_path / "run").task == easy
    asked = benchmark.Benchmark((str(tmp_path / "run"),))
    judged = benchmark._entered(asked, str(tmp_path / "run"), tmp_path / "run.onnx")
    assert judged.task == config.task
    assert not judged.env.randomize


def test_a_card_has_every_part_and_the_same_command_goes_on(
    small: None, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    del small
    asked = ["benchmark", "hover", "--episodes", "4", "--flights", "1", "--out", str(tmp_path / "card")]
    assert run(asked) == 0
    card = json.loads((tmp_path / "card" / "card.json").read_text())
    assert (card["seed"], card["cards"][0]["vehicle"], card["cards"][0]["task"]) == (SEED, "vis_r", "hover")
    rows = [(part["place"], list(part["rows"]), part["episodes"]) for part in card["cards"][0]["parts"]]
    assert rows == [
        ("training", ["0 ms", "60 ms"], 4),
        ("training", ["nominal", "mass x1.25"], 4),
        ("training", ["delay walks"], 4),
        ("mujoco", ["nominal"], 1),
        ("mujoco", ["delay walks"], 1),
    ]
    shown = (tmp_path / "card" / "card.md").read_text()
    assert "| hover | hover | vis_r | 100.0 (51.0 to 100.0) | 100.0 (51.0 to 100.0) | " in shown
    assert "### Rows from laws that no training draws from: mujoco" in shown
    capsys.readouterr()
    monkeypatch.setattr(scorecard, "_flown", lambda *_: pytest.fail("it is known"))
    assert run(asked) == 0
    assert "100.0 (51.0 to 100.0)" in capsys.readouterr().out
    assert json.loads((tmp_path / "card" / "card.json").read_text()) == card


def test_rows_that_a_plant_cannot_reproduce_are_named_on_the_card(
    small: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    del small
    plant = scorecard.find_plant("mujoco")
    monkeypatch.setattr(plant, "alters", plant.alters - {"mass"})
    monkeypatch.setattr(scorecard, "ON_PLANTS", {"trained": ("nominal", "mass x1.25")})
    found = entrant(made(tmp_path / "x.onnx", 0.01))
    part = scorecard._flown(found, "mujoco", "trained", 1)
    assert (list(part["rows"]), part["left_out"]) == (["nominal"], {"mass x1.25": "mass"})
    shown = {"place": "mujoco", "kind": "trained", "episodes": 1, "seconds": 1.0, "cpu": "x", "date": "", "e2efly": ""}
    card = {"policy": "x", **scorecard.about(found), "notes": [], "parts": [shown | part]}
    assert "Left out: mass x1.25; mujoco cannot change mass." in page({"benchmark": 1, "seed": SEED, "cards": [card]})


def test_a_plant_that_does_not_fly_a_policy_is_told_on_the_card(small: None, tmp_path: Path) -> None:
    del small
    config = presets.preset("hover", "ppo")
    config = dataclasses.replace(config, env=dataclasses.replace(config.env, command_mode="rotor_share"))
    from e2efly.environment import Env

    file = made(tmp_path / "x.onnx", 0.01, Env.of(config.task, config.reward, config.env), config)
    part = scorecard._flown(entrant(file), "betaflight", "trained", 1)
    assert "plant 'betaflight' takes no 'rotor_share' commands" in part["refused"]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["hover", "--episodes", "0"], "--episodes is 0; accepted: more than 0"),
        (["hover", "--plants", "mujocoo"], "unknown plant 'mujocoo'; did you mean 'mujoco'?"),
        (["hover", "--plants", "mujoco", "mujoco"], "--plants has 'mujoco' twice; accepted: each once"),
        (["hover", "hover"], "POLICY is hover, and hover has the name 'hover', too; accepted: each name once"),
        (["hoover"], "unknown policy 'hoover'; did you mean 'hover'?"),
        (["any/hover"], "--vehicle is left out; accepted: one vehicle within the ranges of any"),
        (["hover", "--vehicle", "vis_x"], "unknown vehicle 'vis_x'; did you mean"),
        (["gap", "--baseline", "pid"], "--baseline is 'pid', and task 'gap' of the policy shows it no place to fly to"),
        (["model.zip"], "POLICY is model.zip; accepted: what `e2efly.export(model, 'policy.onnx')` writes"),
        (["other.onnx"], "other.onnx: is no policy.onnx of e2efly, which has its contract in it; accepted: one as"),
        (["said.onnx"], "said.contract.json: contract: lacks action; accepted: all of task, vehicle, control_rate_hz"),
    ],
)
def test_bad_input_of_the_benchmark_is_named_before_anything_flies(
    arguments: list[str], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(scorecard, "_flown", lambda *_: pytest.fail("it flies"))
    for name in ("other.onnx", "said.onnx"):
        Path(name).write_bytes(b"an ONNX file")
    contract = {"task": "hover", "vehicle": "vis_r", "control_rate_hz": 50, "observation": [{"field": "velocity"}]}
    Path("said.contract.json").write_text(json.dumps(contract))
    assert said in error_of(["benchmark", *arguments], capsys)
    assert not list(tmp_path.rglob("card.json"))


def test_a_plant_whose_package_is_missing_is_named_before_anything_flies(monkeypatch: pytest.MonkeyPatch) -> None:
    from e2efly.validation.plants import PLANTS

    monkeypatch.setattr(PLANTS["mujoco"], "needs", {"no_such_package": "e2efly[x]"})
    with pytest.raises(
        ValueError, match=r"plant 'mujoco' needs the package no_such_package: pip install 'e2efly\[x\]'"
    ):
        CardScale().check()
