"""The pages that are made from other files are what these files say today."""

import dataclasses
import importlib.util
import json
import re
import subprocess
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from PIL import Image

from e2efly.alignment.parts import prototype
from e2efly.commands.train import parse
from e2efly.config import StageConfig
from e2efly.policy.zoo import FOLDER, USUAL, contents, curve_file, policy_file
from e2efly.runs.rundir import RunDirectory
from e2efly.tasks import TASKS
from tests.docs.pages import DOCS, ROOT

NOTEBOOKS = sorted((DOCS / "notebooks").glob("*.ipynb"))


def script(name: str, folder: Path = DOCS) -> ModuleType:
    spec = importlib.util.spec_from_file_location(f"{folder.name}_{name}", folder / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(folder)  # a script finds the files beside it
        spec.loader.exec_module(module)
    return module


def test_the_page_of_the_command_line_is_what_the_commands_say() -> None:
    code = "import sys; sys.path.insert(0, 'docs'); import command_line; sys.stdout.write(command_line.page())"
    alone = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert (DOCS / "reference" / "command-line.md").read_text(encoding="utf-8") == alone.stdout


@pytest.mark.whole
def test_the_page_of_the_zoo_is_what_the_zoo_says() -> None:
    assert (DOCS / "zoo.md").read_text(encoding="utf-8") == script("zoo_cards").page()


def test_the_figures_are_what_was_measured_and_say_by_which_preset() -> None:
    """Also after a change of a preset: its figures are then marked as earlier, or measured anew."""
    figures = script("figures")
    assert (ROOT / "README.md").read_text(encoding="utf-8") == figures.readme()
    assert (DOCS / "benchmarks.md").read_text(encoding="utf-8") == figures.benchmarks()
    assert figures.TITLES.keys() == figures.POLICIES.keys()


def test_the_page_of_the_scores_is_what_was_measured_by_todays_benchmark() -> None:
    page = script("scorecards_page")
    assert (DOCS / "benchmark.md").read_text(encoding="utf-8") == page.page()
    measured = json.loads(page.RESULTS.read_text(encoding="utf-8"))
    assert (measured["seed"], measured["version"]) == (page.SEED, page.VERSION)


def test_the_page_of_the_physics_has_what_the_rate_loop_was_measured_to_cost() -> None:
    page, measured = (DOCS / "physics.md").read_text(encoding="utf-8"), script("figures").results("rate_loop")
    held, one, four = measured["table"]
    assert f"{held['mean, mm']} mm off" in page
    assert f"{one['mean, mm']} mm off" in page and f"{one['largest, mm']} mm at most" in page
    assert f"4 kHz {four['mean, mm']} mm, at most {four['largest, mm']}" in page
    assert f"{measured['date']}" in page


@pytest.mark.parametrize(("digit", "marked"), [("", ""), ("0", ", earlier")])
def test_a_figure_of_another_configuration_than_todays_is_marked(
    digit: str, marked: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    figures, command = script("figures"), "train land --preset nominal --stop-at 0.99"
    known = f"{digit}{figures.today(command)}"[:12]
    table = {"task": "land", "integrator": "rk3", "configuration": known}
    (tmp_path / "x.json").write_text(
        json.dumps({"table": [table], "runs": [{"command": command, "configuration": known}]})
    )
    monkeypatch.setattr(figures, "RESULTS", tmp_path)
    assert figures.results("x")["table"][0]["configuration"] == known + marked


def test_a_benchmark_goes_on_where_it_was_and_keeps_nothing_of_another_configuration_or_machine(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(ROOT / "benchmarks")
    common, file, done = script("common", ROOT / "benchmarks"), tmp_path / "x.json", []

    def run(seed: int, steps: int = 10_000) -> list[tuple[int, str]]:
        about = {"seed": seed, **common.training(f"train hover --preset nominal --steps {steps}")}
        common.measured("x", file, about, lambda: done.append(seed) or {"s": 1.0}, lambda runs: runs)
        return [(row["seed"], row["preset"]) for row in json.loads(file.read_text())["table"]]

    assert run(0) == [(0, "nominal")]
    assert run(0) == [(0, "nominal")]
    assert run(1) == [(0, "nominal"), (1, "nominal")]
    assert done == [0, 1]
    content = json.loads(file.read_text())
    content["runs"][0]["configuration"] = "of another day"
    file.write_text(json.dumps(content))
    assert run(2) == [(1, "nominal"), (2, "nominal")]
    monkeypatch.setattr(common, "machine", lambda: {"cpu": "another"})
    assert run(3) == [(3, "nominal")]


def test_a_configuration_is_everything_that_defines_a_training_but_its_seed_and_its_cores() -> None:
    today, hover = script("figures").today, "train hover --algo ppo --preset nominal"
    assert today(f"{hover} --seed 7 --devices 1") == today(hover)
    others = ("--env.integrator rk4", "--env.wind 1", "--vehicle vis_h", "--stop-at 0.9", "--task.radius 0.2",
              "--algo.envs 32", "--reward.weights v 0.1", "--env.randomize mass 0.1", "--steps 10000")  # fmt: skip
    assert len({today(hover), *(today(f"{hover} {other}") for other in others)}) == 1 + len(others)


def test_the_page_of_the_papers_claims_is_what_was_measured(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever tasks of one's own there are beside."""
    mine = type("Mine", (TASKS["hover"],), {"__module__": "mine"})
    monkeypatch.setattr(TASKS, "_known", {**TASKS._known, "mine": mine})
    assert (DOCS / "paper.md").read_text(encoding="utf-8") == script("paper_page").page()


def test_the_curves_of_the_papers_figures_are_drawn_from_what_there_is(tmp_path: Path) -> None:
    curves = script("paper_curves")
    curves.DOCS = tmp_path
    assert curves.learning([], "paper") is None
    assert curves.ablation([], "ppo") is None
    assert curves.visual([], []) is None

    def run(task: str, algo: str, variant: str, steps: str, success: str) -> dict[str, Any]:
        curve = {"steps": steps, "return": success, "success": success}
        return {"task": task, "algo": algo, "variant": f"paper, {variant} rewards", "curve": curve}

    few = [run("hover", "ppo", "identical", "1e6 2e6 3e6", "0 0.5 1"), run("hover", "bptt", "identical", "1e6", "1")]
    assert curves.learning(few, "authors") is None
    with Image.open(curves.learning(few, "paper")) as picture:
        assert np.asarray(picture.convert("RGB")).std() > 5


@pytest.mark.parametrize("name", ["vis_r", "vis_h"])
def test_the_page_and_the_drawing_of_a_vehicle_are_what_its_files_say(name: str) -> None:
    pages = script("hardware_pages")
    text = pages.where(name).read_text(encoding="utf-8")
    assert text == pages.page(name)
    assert pages.where(name).with_suffix(".svg").read_text(encoding="utf-8") == pages.picture(name)
    without, _, paper, difference, loaded, _ = pages.sums(name, *pages.lists(name))
    told = [f"{loaded['mass, g']} g"]
    told += [f"{abs(int(difference['mass, g']))} g lighter", f"{paper['mass, g']} g"] if name == "vis_r" else []
    told += [f"{int(difference['price, USD'])} USD above"] if name == "vis_r" else [f"{without['mass, g']} g without"]
    written = (DOCS / "hardware-vis-r.md").read_text(encoding="utf-8").split(pages.END)[1]
    assert all(words in written for words in told)
    found = prototype(pages.lists(name)[0])
    spread = zip(1e3 * np.diag(found.inertia), 1e3 * np.diag(found.inertia_sigma), strict=True)
    inertia = ", ".join(f"{value:.2f} ± {sigma:.2f}" for value, sigma in spread)
    assert f"| {inertia} |" in (DOCS / "identification.md").read_text(encoding="utf-8")


def test_every_policy_of_the_zoo_has_a_card_and_pictures() -> None:
    page = (DOCS / "zoo.md").read_text(encoding="utf-8")
    for vehicle, tasks in contents().items():
        for task in tasks:
            assert f"### {vehicle}/{task}\n" in page
            assert (DOCS / "zoo" / f"{vehicle}-{task}.png").read_bytes()[1:4] == b"PNG"
            if vehicle == USUAL:
                assert (DOCS / "zoo" / f"{vehicle}-{task}.webp").read_bytes()[8:12] == b"WEBP"


def test_the_command_of_a_card_gives_the_configuration_of_its_policy() -> None:
    cards, page = script("zoo_cards"), (DOCS / "zoo.md").read_text(encoding="utf-8")
    commands = re.findall(r"### (\S+)\n(?:(?!###).*\n)*?\| trained by \| `e2efly ([^`]+)`", page)
    assert [name for name, _ in commands] == re.findall(r"### (\S+)\n", page)
    for name, command in commands:
        vehicle, task = name.split("/")
        config = parse(command.split()[1:]).config
        assert config == cards.configured(policy_file(name)), name
        chunk = config.algo.steps * config.chunk
        assert -(-config.steps // chunk) * chunk == contents()[vehicle][task]["env_steps"], name


def test_a_card_says_where_todays_command_makes_another_policy() -> None:
    made_by, command = script("zoo_cards").made_by, "train hover --seed 0"
    config = parse(command.split()[1:]).config
    assert made_by(command, config) == f"`e2efly {command}`"
    longer = dataclasses.replace(config, steps=3_133_440)
    assert made_by(command, longer) == f"`e2efly {command} --steps 3133440` (today's preset has steps {config.steps})"
    other = dataclasses.replace(config, curriculum=(StageConfig({"radius": 1.0}, steps=10),))
    assert made_by(command, other).startswith("no command of today: it had curriculum (StageConfig(")


def test_every_curve_that_ships_stands_on_its_card() -> None:
    page = (DOCS / "zoo.md").read_text(encoding="utf-8")
    drawn = {path.name for path in (DOCS / "zoo").glob("*-training.png")}
    kept = [file for file in FOLDER.glob("*/*.onnx") if curve_file(file).is_file()]
    assert drawn == {f"{file.parent.name}-{file.stem}-training.png" for file in kept}
    for name in drawn:
        assert f"](zoo/{name})" in page


def test_the_curve_of_a_training_is_kept_in_few_points_and_drawn(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(ROOT / "benchmarks")
    run = RunDirectory(tmp_path)
    for update in range(1, 1001):
        evaluated = {"seconds": 0.1 * update, "eval/hover/success": update / 1000} if update % 2 == 0 else {}
        blank = {"update": update, "steps": 100 * update, "seconds": "", "eval/hover/success": "", "reward": 1.0}
        run.append([{**blank, **evaluated}])  # type: ignore[list-item]
    lines = script("zoo", ROOT / "benchmarks").curve(run).splitlines()
    assert lines[0] == "steps,seconds,hover"
    assert lines[-1] == "100000,100.0,1"
    assert 100 <= len(lines) <= 201
    (tmp_path / "hover.curve.csv").write_text("\n".join([*lines, ""]))
    script("zoo_pictures").curve(tmp_path / "hover.curve.csv", tmp_path / "curve.png", "Training")
    with Image.open(tmp_path / "curve.png") as picture:
        assert picture.width == 800
        assert np.asarray(picture.convert("RGB")).std() > 5


def test_limits_are_the_worst_rows_first() -> None:
    limits = script("zoo_cards").limits
    about = {"stress": {"nominal": 0.5, "all at once": 0.1, "a": 1.0, "b": 0.999, "c": 0.25, "d": 0.75, "e": 0.8}}
    assert limits(about) == [
        "| under stress: c | 25.0 % |",
        "| under stress: d | 75.0 % |",
        "| under stress: e | 80.0 % |",
    ]
    assert limits({}) == []
    untrained = {"untrained": {"x": 0.5, "y": 1.0}}
    assert limits(untrained, "untrained", "not in training") == ["| not in training: x | 50.0 % |"]


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_the_page_of_a_notebook_is_what_the_notebook_has(notebook: Path, tmp_path: Path) -> None:
    copy = tmp_path / notebook.name
    copy.write_bytes(notebook.read_bytes())
    assert notebook.with_suffix(".md").read_text(encoding="utf-8") == script("notebook_pages").page(copy)
    pictures = sorted(tmp_path.glob("*.png"))
    assert pictures
    assert all(picture.read_bytes() == (notebook.parent / picture.name).read_bytes() for picture in pictures)
