"""`e2efly alignment-report`: the four stages on one page."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

from e2efly.alignment.estimates import Estimate
from e2efly.alignment.vehicle_file import write_vehicle
from e2efly.commands.cli import run
from e2efly.config.storage import write_json
from e2efly.logs.csv_file import write_csv
from e2efly.vehicles.loading import load_vehicle
from e2efly.viewing.style import figure
from tests.alignment.test_sensor_noise import hover

STRANGE = "<script>alert('1')</script>.csv"
HELD_OUT = {"body_rate": {"seconds": [0.1, 0.2], "before": [0.5, None], "after": [0.25, None]}}


def identified(folder: Path) -> Path:
    """What `e2efly identify` writes, as far as the page uses it."""
    folder.mkdir()
    mass = Estimate("mass", np.array(0.9), np.array(0.018), STRANGE)
    write_vehicle(folder / "vehicle.toml", "vis_r", load_vehicle("vis_r"), {"mass": mass})
    write_json(folder / "identified.json", {
        "vehicle": "vis_r",
        "parameters": {"mass": {"value": 0.9, "sigma": 0.018, "source": STRANGE, "before": 0.75}},
        "flight": {
            "driven_by": "command", "seconds": 18.0, "refused": ["drag_linear_x is not taken"], "held_out": HELD_OUT,
            "misfit": [{"sensor": "body_rate", "share": 0.5, "pull": 23.0, "alarming": True}],
        },
    })  # fmt: skip
    with figure(folder / "parameters.png", "", 1.0):
        pass
    return folder


def aligned(folder: Path) -> Path:
    """What `e2efly align` writes, as far as the page uses it."""
    folder.mkdir()
    row = {"before": 0.06, "after": 0.045, "sigma": 0.002, "unit": "s"}
    rms = {"roll_rate": {"unit": "rad/s", "before": 0.3, "after": 0.03}}
    write_json(folder / "align.json", {
        "vehicle": "vis_r", "parameters": [{"name": "latency", **row}], "delay_from": "setpoints", "refused": [],
        "held_out": {"length_s": 0.4, "rms": rms}, "policy": None,
    })  # fmt: skip
    return folder


def texts(page: str) -> str:
    return re.sub(r"<[^>]*>", " ", page)


def test_the_four_stages_are_on_one_page(tmp_path: Path) -> None:
    write_csv(hover(), tmp_path / "hover.csv")
    out = tmp_path / "page"
    folders = [str(identified(tmp_path / "identified")), str(aligned(tmp_path / "aligned"))]
    assert run(["alignment-report", *folders, "--hover", str(tmp_path / "hover.csv"), "--out", str(out)]) == 0
    page = (out / "report.html").read_text()
    told = texts(page)
    for stage in ("1. System identification", "2. Latency and rate loop", "3. Domain randomisation", "4. Sensor noise"):
        assert stage in told
    assert "<script" not in page and "&lt;script&gt;" in page
    assert not re.search(r'(src|href)="(?!data:)', page)
    assert page.count('src="data:image/png;base64,') == 2  # parameters.png and noise.png
    for text in ("0.9 ± 0.018", "0.5 → 0.25", "drag_linear_x is not taken", "body_rate 50 %", "0.045 ± 0.002"):
        assert text in told
    assert re.search(r"mass\s+2 %", told)
    assert "--env.noise.body-rate 0.05" in told  # measured 0.05 rad/s, and the preset robust has 0.02
    assert re.search(r"position\s+100 Hz\s+0.00\d+ 0.00\d+ 0.00\d+\s+m\s+0.01\s+covers it", told)


def test_what_is_not_there_is_said_with_how_to_get_it(tmp_path: Path) -> None:
    (tmp_path / "all").mkdir()
    aligned(tmp_path / "all" / "aligned")  # one level below, as tune has them
    assert run(["alignment-report", str(tmp_path / "all"), "--out", str(tmp_path / "page")]) == 0
    told = texts((tmp_path / "page" / "report.html").read_text())
    assert "No identification was given. e2efly identify" in told and "--hover LOG" in told


@pytest.mark.parametrize(
    ("asked", "message"),
    [
        ([], "FOLDERS is empty"),
        (["nowhere"], "nowhere: has neither identified.json nor align.json; accepted: a folder that e2efly identify"),
        (["aligned", "--preset", "robbust"], "unknown preset 'robbust'"),
        (["aligned", "--hover", "gone.csv"], "log 'gone.csv' does not exist"),
    ],
)
def test_wrong_options_are_refused_and_nothing_is_written(
    asked: list[str], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    aligned(tmp_path / "aligned")
    write_csv(hover(), tmp_path / "hover.csv")
    more = [] if "--hover" in asked or not asked else ["--hover", "hover.csv"]
    assert run(["alignment-report", *asked, *more]) == 2
    assert message in " ".join(capsys.readouterr().err.split())
    assert not (tmp_path / "alignment_report").exists()


def test_a_report_of_another_program_is_refused_by_name(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "align.json").write_text(json.dumps({"vehicle": "vis_r"}))
    assert run(["alignment-report", str(tmp_path), "--out", str(tmp_path / "page")]) == 2
    assert "align.json" in " ".join(capsys.readouterr().err.split())
