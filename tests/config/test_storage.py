"""Files that a crash cannot spoil, and folders that one process at a time writes to."""

import json
import math
import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from e2efly.config.storage import LOCK, held, read_json, write_json
from e2efly.viewing.style import figure

HOLD = """
import sys, time
from pathlib import Path
from e2efly.config.storage import held
with held(Path(sys.argv[1])):
    print("held", flush=True)
    time.sleep(60)
"""


def holder(folder: Path) -> "subprocess.Popen[str]":
    process = subprocess.Popen([sys.executable, "-c", HOLD, str(folder)], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    assert process.stdout.readline() == "held\n"
    return process


def test_a_held_folder_is_refused_with_who_has_it_until_that_process_is_killed(tmp_path: Path) -> None:
    process = holder(tmp_path / "run")
    said = rf"--out .*run is in use by process {process.pid} on {os.uname().nodename} since \d{{4}}-\d\d-\d\d \d\d:\d\d"
    with pytest.raises(ValueError, match=said), held(tmp_path / "run"):
        pass
    process.send_signal(signal.SIGKILL)
    process.communicate()
    assert (tmp_path / "run" / LOCK).exists()  # what a killed process leaves keeps nobody out
    with held(tmp_path / "run"):
        pass
    assert list((tmp_path / "run").iterdir()) == []


def test_what_a_killed_process_had_not_finished_goes_and_what_others_write_stays(tmp_path: Path) -> None:
    process = holder(tmp_path / "other")
    dead, alive = (tmp_path / f"vehicle.toml.{number}.part" for number in (2**30, process.pid))
    for part in (dead, alive):
        part.touch()
    with held(tmp_path):
        assert not dead.exists()
        assert alive.exists()
    process.kill()
    process.communicate()


def test_a_picture_on_a_full_disk_is_named_and_the_last_one_stays(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "plot.png"
    path.write_bytes(b"the last one")

    def full(_: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match=r"cannot write .*plot\.png: No space left on device"), figure(path, "title", 2.0):
        pass
    assert path.read_bytes() == b"the last one"
    assert [file.name for file in tmp_path.iterdir()] == ["plot.png"]


def test_a_folder_that_nothing_was_written_to_goes_again(tmp_path: Path) -> None:
    with held(tmp_path / "run"):
        assert (tmp_path / "run").is_dir()
    assert not (tmp_path / "run").exists()


def test_the_same_process_is_refused_too_and_a_failure_lets_go(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=f"in use by process {os.getpid()} "), held(tmp_path), held(tmp_path):
        pass
    with held(tmp_path):
        pass


def test_json_with_a_byte_order_mark_is_read(tmp_path: Path) -> None:
    (tmp_path / "file.json").write_text('{"a": 1}', encoding="utf-8-sig")
    assert read_json(tmp_path / "file.json") == {"a": 1}


def test_json_has_null_where_a_number_is_not_finite(tmp_path: Path) -> None:
    content = {"a": math.nan, "b": [math.inf, 1.5], "c": {"d": (-math.inf, "text", None, np.float64("nan"))}}
    write_json(tmp_path / "file.json", content)

    def no(constant: str) -> None:
        raise AssertionError(f"{constant} is no JSON")

    found = json.loads((tmp_path / "file.json").read_text(), parse_constant=no)
    assert found == {"a": None, "b": [None, 1.5], "c": {"d": [None, "text", None, None]}}
