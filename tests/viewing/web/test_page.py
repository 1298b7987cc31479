"""What an exported page consists of, and what is refused."""

import hashlib
from pathlib import Path

import pytest

from e2efly.commands.cli import run
from e2efly.viewing.web.page import ASSETS, COPIED

ROOT = Path(__file__).parents[3]
SOURCES = ("build.js", "package-lock.json", "package.json")


def test_the_page_is_built_from_its_sources() -> None:
    """`make web` was run after the last change of them."""
    web = ROOT / "web"
    names = [*SOURCES, *(path.relative_to(web).as_posix() for path in web.glob("src/**/*") if path.is_file())]
    found = hashlib.sha256()
    for name in sorted(names):
        found.update(f"{name}\0{(web / name).read_text(encoding='utf-8')}\0".encode())
    assert found.hexdigest() in (ASSETS / "page.js").read_text(encoding="utf-8").split("\n")[0]


def test_packages_of_the_page_are_pinned() -> None:
    assert '"^' not in (text := (ROOT / "web" / "package.json").read_text())
    assert '"~' not in text
    assert "resolved" not in (ROOT / "web" / "package-lock.json").read_text()


def test_a_page_is_small_and_needs_no_server(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["export", "race", "--web", str(tmp_path / "a" / "page")]) == 0
    assert "index.html" in capsys.readouterr().out
    files = {path.name: path for path in (tmp_path / "a" / "page").iterdir()}
    assert set(files) == {*COPIED, "flight.js"}
    assert files["page.js"].stat().st_size < 1_000_000
    assert sum(path.stat().st_size for path in files.values()) < 1_500_000
    index = files["index.html"].read_text()
    assert "http" not in index
    assert 'type="module"' not in index  # browsers refuse modules from file://


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["avoid"], "sees by cameras: image_0 (depth, 12 x 32); accepted: a policy without cameras"),
        (["race", "--out", "x.onnx"], "--out is 'x.onnx', which has no effect with --web"),
        (["race", "--which", "last"], "--which is 'last', which has no effect with --web"),
        (["hoover"], "unknown policy 'hoover'"),
    ],
)
def test_what_no_page_can_fly_is_refused(
    arguments: list[str], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["export", *arguments, "--web", str(tmp_path / "page")]) == 2
    told = " ".join(capsys.readouterr().err.split())
    assert message in told
    assert not (tmp_path / "page").exists()


def test_a_folder_that_is_a_file_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "page").write_text("")
    assert run(["export", "hover", "--web", str(tmp_path / "page")]) == 2
    assert "accepted: a folder" in " ".join(capsys.readouterr().err.split())


def test_a_vehicle_without_a_page_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["export", "hover", "--vehicle", "vis_h"]) == 2
    assert "--vehicle is 'vis_h'; accepted: with --web or --crazyflie" in " ".join(capsys.readouterr().err.split())
