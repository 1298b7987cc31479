"""The page of a GPU's figures, and the benchmark that measures them, where there is no GPU."""

import importlib
import os
import subprocess
import sys

import pytest

from tests.docs.pages import DOCS, ROOT
from tests.docs.test_generated import script

BENCHMARKS = ROOT / "benchmarks"


def test_the_page_is_what_was_measured() -> None:
    assert (DOCS / "gpu.md").read_text(encoding="utf-8") == script("gpu_page").page()


def test_without_a_gpu_nothing_is_measured_or_written() -> None:
    before = (BENCHMARKS / "results" / "gpu.json").read_bytes()
    command = [sys.executable, str(BENCHMARKS / "gpu.py")]
    where = os.environ | {"JAX_PLATFORMS": "cpu"}
    done = subprocess.run(command, capture_output=True, text=True, env=where, check=False)
    assert (done.returncode, done.stdout) == (1, "")
    assert "no GPU here that JAX could use: nothing was measured, nothing was written" in done.stderr
    assert (BENCHMARKS / "results" / "gpu.json").read_bytes() == before


def test_a_part_that_takes_too_long_or_fails_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    gpu = importlib.import_module("gpu")
    assert sum(seconds for seconds, _ in gpu.PARTS.values()) + gpu.START <= 8 * 60
    assert gpu.measured("hover", True, "cpu", 0.2) == ([], "its 0 s were over")
    rows, why = gpu.measured("no_such_part", True, "cpu", 60)
    assert (rows, why) == ([], "KeyError: 'no_such_part'")
    figures = (13.1e9, "/s"), (8.04, "s"), (float("nan"), "s")
    assert [gpu.shown(*figure) for figure in figures] == ["13.1 G/s", "8.0 s", "not reached"]
