"""`e2efly watch` without a browser: bad input, and what it is to programs that it runs beside."""

import contextlib
import os
import signal
import socket
import subprocess
import sys
import threading
import urllib.request

import pytest

from e2efly.viewing.watch.waiting import MARK, asked_for
from tests.waiting import free_port, running, until


@pytest.mark.parametrize(("arguments", "told"), [
    ([], "WHAT is empty; accepted: one or more"),
    (["hover", "--count", "0"], "--count is 0; accepted: 1 to 1024"),
    (["hover", "--port", "70000"], "--port is 70000; accepted: 0 to 65535"),
    (["hover", "race"], "accepted: one policy or run, or several flight logs"),
    (["nowhere.mcap"], "unknown policy 'nowhere.mcap'"),
    (["runs/nothing"], "a run directory, or the path of a policy.onnx, a flight log, or a report of `e2efly validate"),
    (["any/hovr"], "unknown policy 'any/hovr'; did you mean 'any/hover'?"),
    (["hover", "--vehicle", "vis_x"], "unknown vehicle 'vis_x'"),
    (["hover", "--video", "x.mp4"], "needs the program ffmpeg; accepted: that, or a name that ends in .webm or .gif"),
    (["hover", "--video", "x.gif"], "need the package embreex: pip install 'e2efly[mesh]'"),
    (["hover", "--criterion", "x"], "--criterion is 'x'; accepted: hover"),
    (["hover", "--video", "x.avi"], "accepted: a name that ends in .gif, .mp4, .webm, .png"),
])  # fmt: skip
def test_bad_input_is_named_before_there_is_a_page(
    arguments: list[str], told: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    from e2efly.commands.cli import run

    monkeypatch.setenv("PATH", "")  # without ffmpeg

    monkeypatch.setitem(sys.modules, "embreex", None)

    port = [] if "--port" in arguments else ["--port", "0"]
    assert run(["watch", *arguments, *port]) == 2
    said = capsys.readouterr()
    assert told in said.err
    assert "Look at" not in said.out


def test_a_port_in_use_is_named(capsys: pytest.CaptureFixture[str]) -> None:
    from e2efly.commands.cli import run

    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = str(taken.getsockname()[1])
        assert run(["watch", "hover", "--port", port]) == 2
    assert f"--port {port} is in use on 127.0.0.1" in capsys.readouterr().err


def test_nothing_is_computed_until_a_browser_asks_for_the_page() -> None:
    port = free_port()
    asked: list[bool] = []
    over = threading.Event()
    waiting = threading.Thread(target=lambda: asked.append(asked_for("127.0.0.1", port, over.is_set)))
    waiting.start()
    waiting.join(1.0)
    assert waiting.is_alive()
    with urllib.request.urlopen(f"http://127.0.0.1:{port}/") as answer:
        assert MARK in answer.read().decode()
    waiting.join(10.0)
    assert asked == [True]
    over.set()
    assert not asked_for("127.0.0.1", port, over.is_set)  # the port is free again at once


def test_a_viewer_beside_a_program_ends_with_it() -> None:
    code = (
        "import sys, time; from e2efly.viewing.watch.beside import Shown\n"
        "shown = Shown(0, '--vehicle', 'vis_r'); print(shown.page._process.pid, flush=True); time.sleep(60)\n"
    )
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True) as program:
        assert program.stdout is not None
        viewer = int(program.stdout.readline())
        program.kill()
    try:
        until(lambda: not running(viewer), 60.0)
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.kill(viewer, signal.SIGKILL)
