"""`make test` leaves out what is marked `whole`, and nothing that somebody names."""

import subprocess
import sys
from pathlib import Path

import pytest

CONFTEST = Path(__file__).with_name("conftest.py")
FILE = """
import pytest

@pytest.mark.whole
def test_long(): ...

@pytest.mark.whole(but=1)
@pytest.mark.parametrize("case", ["first", "second", "third"])
def test_cases(case): ...

def test_short(): ...
"""


def collected(folder: Path, *options: str) -> list[str]:
    """The tests that a run of a suite with our own rules would run; all that is said where it refuses."""
    command = [sys.executable, "-m", "pytest", "--collect-only", "-q", "--no-header", *options]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    if done.returncode:
        return [done.stdout + done.stderr]
    return [line.rpartition("::")[2] for line in done.stdout.splitlines() if "::" in line]


@pytest.fixture
def suite(tmp_path: Path) -> Path:
    """A suite of one folder with our conftest."""
    (tmp_path / "pyproject.toml").write_text(
        '[tool.pytest.ini_options]\ntestpaths = ["tests"]\nmarkers = ["whole"]\naddopts = "-p no:cacheprovider"\n'
    )
    (tmp_path / "tests" / "part").mkdir(parents=True)
    (tmp_path / "tests" / "conftest.py").write_text(CONFTEST.read_text(encoding="utf-8"))
    (tmp_path / "tests" / "part" / "test_it.py").write_text(FILE)
    return tmp_path


@pytest.mark.whole
def test_the_short_suite_leaves_out_what_is_marked_but_for_its_first_cases(suite: Path) -> None:
    every = ["test_long", "test_cases[first]", "test_cases[second]", "test_cases[third]", "test_short"]
    assert collected(suite) == ["test_cases[first]", "test_short"]
    assert collected(suite, "--whole") == every
    assert collected(suite, "--rest") == every[:-1]
    assert collected(suite, "tests/part/test_it.py") == every
    assert collected(suite, "tests/part/test_it.py::test_long") == ["test_long"]


def test_a_part_without_a_test_in_the_short_suite_is_refused(suite: Path) -> None:
    (suite / "tests" / "other").mkdir()
    (suite / "tests" / "other" / "test_alone.py").write_text("import pytest\n@pytest.mark.whole\ndef test_it(): ...\n")
    (told,) = collected(suite)
    assert "every test is `whole` in" in told and "other" in told
