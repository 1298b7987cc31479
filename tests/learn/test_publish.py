"""Publishing a run: everything once, whatever happens to the run and to whoever publishes it."""

import os
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from e2efly.cli import run as cli
from e2efly.learn import trackers
from e2efly.learn.publish import publish
from e2efly.learn.rundir import RunDirectory
from e2efly.learn.trackers import Asked, Opened
from e2efly.storage import held, is_held
from tests.learn.test_runner import small


def rows(*updates: int) -> list[dict[str, float]]:
    """Metrics of some updates, every second with an evaluation."""
    return [
        {"update": u, "steps": 1000 * u, "seconds": "" if u % 2 else 0.1 * u, "reward": -1.0 / u}  # type: ignore[misc]
        for u in updates
    ]


def run_with(path: Path, *updates: int, seed: int = 0) -> RunDirectory:
    run = RunDirectory(path)
    run.create(small("hover", "ppo", seed=seed))
    run.append(rows(*updates))
    return run


class Board:
    """A tracker that keeps what it is sent."""

    def __init__(self) -> None:
        self.asked: list[Asked] = []
        self.sent: list[tuple[int, dict[str, float]]] = []
        self.open = 0

    @contextmanager
    def __call__(self, asked: Asked) -> Iterator[Opened]:
        self.asked.append(asked)
        self.open += 1
        yield Opened("there", lambda numbers, step: self.sent.append((step, dict(numbers))))
        self.open -= 1

    @property
    def steps(self) -> list[int]:
        return [step for step, _ in self.sent]


@pytest.fixture
def board(monkeypatch: pytest.MonkeyPatch) -> Board:
    board = Board()
    monkeypatch.setitem(trackers.TRACKERS, "json", board)  # a package that there is
    return board


def test_a_run_is_sent_once_and_what_comes_later_after_it(tmp_path: Path, board: Board) -> None:
    run = run_with(tmp_path / "run", 1, 2, 3)
    assert publish(run, "json", "mine", "first") == 3
    assert board.asked[0].config["task_name"] == "hover"
    assert board.asked[0].config["versions"]["e2efly"]
    assert (board.asked[0].project, board.asked[0].name, board.asked[0].id) == ("mine", "first", None)
    assert board.sent[:2] == [
        (1000, {"update": 1, "reward": -1.0}),
        (2000, {"update": 2, "seconds": 0.2, "reward": -0.5}),
    ]
    assert publish(run, "json", "mine", "first") == 0
    run.append(rows(4))
    assert publish(run, "json", "mine", "first") == 1
    assert board.steps == [1000, 2000, 3000, 4000]
    assert [asked.id for asked in board.asked] == [None, "there", "there"]
    assert board.open == 0


def test_a_run_that_goes_on_is_followed_through_a_resume_to_its_end(tmp_path: Path, board: Board) -> None:
    run, counts = run_with(tmp_path / "run", 1, 2), list[int]()
    with held(run.path):
        follower = threading.Thread(target=lambda: counts.append(publish(run, "json", "mine", "first", look_s=0.02)))
        follower.start()
        wait_for(lambda: board.steps == [1000, 2000])
        run.append(rows(3, 4))
        wait_for(lambda: len(board.sent) == 4)
        run.forget_after(2)  # killed before a checkpoint, and resumed: 3 and 4 are done again
        run.append(rows(3))
        time.sleep(0.1)
        run.append(rows(4, 5))
        wait_for(lambda: len(board.sent) == 5)
        assert follower.is_alive()
        run.append(rows(6))
    follower.join(10)
    assert board.steps == [1000, 2000, 3000, 4000, 5000, 6000]
    assert counts == [6]


def wait_for(there: object, seconds: float = 10.0) -> None:
    end = time.monotonic() + seconds
    while not there():  # type: ignore[operator]
        assert time.monotonic() < end
        time.sleep(0.01)


def test_a_training_that_compiles_is_waited_for(tmp_path: Path, board: Board) -> None:
    run, counts = RunDirectory(tmp_path / "run"), list[int]()
    with held(run.path):
        follower = threading.Thread(target=lambda: counts.append(publish(run, "json", "mine", "first", look_s=0.02)))
        follower.start()
        time.sleep(0.1)
        run_with(run.path, 1)
        wait_for(lambda: board.steps == [1000])
    follower.join(10)
    assert counts == [1]


def test_another_run_in_the_folder_is_not_mixed_with_the_first(tmp_path: Path, board: Board) -> None:
    run = run_with(tmp_path / "run", 1, 2)
    publish(run, "json", "mine", "first")
    with pytest.raises(
        ValueError, match=r"--project is 'other', but .*run was published in 'mine'; accepted: that, or"
    ):
        publish(run, "json", "other", "first")
    run.write_json("config.json", {**run.read_json("config.json"), "seed": 5})
    with pytest.raises(
        ValueError, match=r"run holds another run than was published; accepted: .* delete .*published/json"
    ):
        publish(run, "json", "mine", "first")
    run.clear()  # as --overwrite does: the new run is published anew
    run_with(run.path, 1, seed=5)
    assert publish(run, "json", "mine", "first") == 1


def test_a_run_that_is_overwritten_while_it_is_followed_ends_the_follower(tmp_path: Path, board: Board) -> None:
    run, errors = run_with(tmp_path / "run", 1, 2), list[str]()

    def follow() -> None:
        try:
            publish(run, "json", "mine", "first", look_s=0.02)
        except ValueError as error:
            errors.append(str(error))

    with held(run.path):
        follower = threading.Thread(target=follow)
        follower.start()
        wait_for(lambda: len(board.sent) == 2)
        run.create(small("hover", "ppo"), overwrite=True)  # the same configuration: only the record is gone
        follower.join(10)
    assert "holds another run than was published" in errors[0]


def test_one_process_publishes_a_run(tmp_path: Path, board: Board) -> None:
    run = run_with(tmp_path / "run", 1)
    with (
        held(run.path / "published" / "json"),
        pytest.raises(ValueError, match=r"RUN .*published/json is in use by pro"),
    ):
        publish(run, "json", "mine", "first")
    assert board.sent == []


def test_bad_input_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("e2efly.commands.publish.raise_at_interrupt", lambda: None)
    monkeypatch.setattr(trackers, "find_spec", lambda name: name)
    assert cli(["publish", str(tmp_path), "--to", "wandb"]) == 2
    assert "holds no run: there is no config.json" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []
    monkeypatch.setattr(trackers, "find_spec", lambda name: None)
    assert cli(["publish", str(tmp_path), "--to", "wandb"]) == 2
    assert "--to wandb needs the package wandb; accepted: pip install 'e2efly[wandb]'" in capsys.readouterr().err


def records_of(file: Path) -> Iterator[bytes]:
    """What a .wandb file holds: blocks of 32 KiB of LevelDB's log, behind a head of 7 bytes."""
    data, at, parts = file.read_bytes(), 7, b""
    while at + 7 <= len(data):
        if (left := 32768 - at % 32768) < 7:
            at += left
            continue
        size, kind = int.from_bytes(data[at + 4 : at + 6], "little"), data[at + 6]
        parts += data[at + 7 : at + 7 + size]
        at += 7 + size
        if kind in (1, 4):  # whole, or the last part
            yield parts
            parts = b""


def test_wandb_gets_every_update_once_and_nothing_of_the_machine(tmp_path: Path) -> None:
    """The real library, which writes what it would send into a folder."""
    run = run_with(tmp_path / "run", 1, 2, 3)
    environment = {**os.environ, "WANDB_MODE": "offline", "HOME": str(tmp_path), "WANDB_DIR": str(tmp_path)}
    command = [sys.executable, "-m", "e2efly", "publish", str(run.path), "--to", "wandb", "--project", "mine"]

    def told() -> str:
        done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        return done.stdout

    assert "Published 3 updates" in told()
    run.append(rows(4))
    assert "Published 1 update of" in told()
    from wandb.proto.wandb_internal_pb2 import Record

    files = sorted(tmp_path.glob("wandb/offline-run-*/*.wandb"))
    assert len({file.name for file in files}) == 1  # the same run there
    assert len(files) == 2
    sent, configurations = list[tuple[int, float, float]](), list[dict[str, str]]()
    for file in files:
        for record in map(Record.FromString, records_of(file)):
            kind = record.WhichOneof("record_type")
            if kind == "history":
                numbers = {item.key or "/".join(item.nested_key): item.value_json for item in record.history.item}
                sent.append((record.history.step.num, float(numbers["update"]), float(numbers["reward"])))
            elif kind == "run":
                assert (record.run.project, record.run.display_name, record.run.host) == ("mine", "run", "")
                configurations.append({entry.key: entry.value_json for entry in record.run.config.update})
            elif kind == "environment":
                assert not any((record.environment.host, record.environment.username, record.environment.program))
                assert not record.environment.HasField("git")
            assert kind not in ("stats", "output", "output_raw", "files")
    assert sent == [(1000 * u, u, -1.0 / u) for u in (1, 2, 3, 4)]
    assert configurations[0]["task_name"] == '"hover"'
    assert "task_name" not in configurations[1]


def test_trackio_is_asked_for_a_run_of_its_own_and_for_the_same_one_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Trackio cannot be installed beside the versions that the tests run with: a stand-in for its four calls."""
    asked, sent = list[dict[str, Any]](), list[tuple[str, int]]()

    def init(**about: Any) -> Any:
        asked.append(about)
        name = about["name"]
        return SimpleNamespace(
            log=lambda metrics, step: sent.append((name, step)), finish=lambda: sent.append((name, -1))
        )

    monkeypatch.setitem(sys.modules, "trackio", SimpleNamespace(init=init))
    monkeypatch.setattr(trackers, "find_spec", lambda name: name)
    run = run_with(tmp_path / "run", 1, 2)
    publish(run, "trackio", "mine", "first")
    run.append(rows(3))
    publish(run, "trackio", "mine", "first")
    name = asked[0]["name"]
    assert name.startswith("first-")
    assert [about["resume"] for about in asked] == ["never", "must"]
    assert [about["config"]["task_name"] for about in asked] == ["hover", "hover"]  # or it would lose it
    assert sent == [(name, 1000), (name, 2000), (name, -1), (name, 3000), (name, -1)]
    publish(run_with(tmp_path / "other", 1), "trackio", "mine", "first")
    assert asked[2]["name"] not in ("first", name)


def test_whether_a_folder_is_held(tmp_path: Path) -> None:
    assert not is_held(tmp_path / "nowhere")
    with held(tmp_path / "run"):
        assert is_held(tmp_path / "run")
        assert is_held(tmp_path / "run")  # asking changes nothing
    assert not is_held(tmp_path / "run")
    (tmp_path / "run").mkdir(exist_ok=True)
    (tmp_path / "run" / ".lock").write_text("{}")  # of a process that was killed
    assert not is_held(tmp_path / "run")
