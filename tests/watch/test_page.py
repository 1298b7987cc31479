"""The viewer's page in a real browser: Debian's Chromium, headless."""

import contextlib
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import Page

from tests.browser import chromium

PATIENCE_MS = 120_000


@contextmanager
def served(*arguments: str) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """`e2efly watch` as a process, and the address that it tells."""
    command = [sys.executable, "-m", "e2efly", "watch", *arguments, "--port", "0"]
    environment = {**os.environ, "COLUMNS": "200", "PYTHONUNBUFFERED": "1"}
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env=environment)
    try:
        assert process.stdout is not None
        told = ""
        for line in process.stdout:
            told += line
            if found := re.search(r"http://[\d.]+:\d+", line):
                yield process, found[0]
                return
        raise AssertionError(told)
    finally:
        process.send_signal(signal.SIGINT)
        try:
            process.wait(20)
        finally:
            process.kill()
            if process.stdout is not None:
                process.stdout.close()


@contextmanager
def page_of(address: str, wrong: list[str]) -> Iterator[Page]:
    """A browser that looks at it; what is wrong on its console is kept."""
    with chromium() as browser:
        page = browser.new_page(viewport={"width": 900, "height": 900})
        page.on("console", lambda m: wrong.append(m.text) if m.type == "error" else None)
        page.on("pageerror", lambda error: wrong.append(str(error)))
        page.goto(address)
        yield page


def wait_for(page: Page, condition: str) -> None:
    """Until JavaScript says so of the page's text."""
    page.wait_for_function(f"(() => {{ const text = document.body.innerText; return {condition}; }})()",
                           timeout=PATIENCE_MS)  # fmt: skip


def time_of(page: Page) -> float:
    """What the panel tells, s."""
    found = re.search(r"([\d.]+) s, [\d.]+ m/s", page.inner_text("body"))
    assert found is not None
    return float(found[1])


def test_a_policy_is_watched_disturbed_and_paused(tmp_path: Path) -> None:
    wrong: list[str] = []
    with served("hover") as (process, address), page_of(address, wrong) as page:
        wait_for(page, "/from its goal/.test(text)")
        page.screenshot(path=tmp_path / "page.png")
        thrust = page.get_by_role("slider").nth(3)
        thrust.press("Home")
        wait_for(page, "text.includes('changed: thrust 50 %')")
        page.get_by_text("Throw", exact=True).click()
        page.get_by_text("Pause", exact=True).click()
        wait_for(page, "text.includes('Go on')")
        page.wait_for_timeout(500)
        stopped = time_of(page)
        page.wait_for_timeout(700)
        assert time_of(page) == stopped
        page.get_by_text("Go on", exact=True).click()
        wait_for(page, f"!text.includes('{stopped:.1f} s, ')")
        assert process.poll() is None
    assert wrong == []
    picture = np.asarray(Image.open(tmp_path / "page.png").convert("RGB"), float)
    assert picture[:, :500].std() > 5  # something is drawn there


def test_a_browser_that_goes_away_does_not_end_the_viewer() -> None:
    wrong: list[str] = []
    with served("hover") as (process, address):
        with page_of(address, wrong) as page:
            wait_for(page, "/from its goal/.test(text)")
        with page_of(address, wrong) as page:
            wait_for(page, "/from its goal/.test(text)")
        assert process.poll() is None
    assert wrong == []


@pytest.mark.parametrize(("arguments", "told"), [
    (["hover", "--count", "0"], "--count is 0; accepted: 1 to 1024"),
    (["hover", "--port", "70000"], "--port is 70000; accepted: 0 to 65535"),
    (["hover", "race"], "accepted: one policy or run, or several flight logs"),
    (["nowhere.mcap"], "'nowhere.mcap' does not exist"),
    (["hover", "--criterion", "x"], "--criterion is 'x'; accepted: hover"),
    (["hover", "--video", "x.avi"], "accepted: a name that ends in .gif, .mp4, .webm, .png"),
])  # fmt: skip
def test_bad_input_is_named(arguments: list[str], told: str, capsys: pytest.CaptureFixture[str]) -> None:
    from e2efly.cli import run

    port = [] if "--port" in arguments else ["--port", "0"]
    assert run(["watch", *arguments, *port]) == 2
    assert told in capsys.readouterr().err


def test_a_port_in_use_is_named(capsys: pytest.CaptureFixture[str]) -> None:
    import socket

    from e2efly.cli import run

    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = str(taken.getsockname()[1])
        assert run(["watch", "hover", "--port", port]) == 2
    assert f"--port {port} is in use on 127.0.0.1" in capsys.readouterr().err


def test_a_viewer_beside_a_program_ends_with_it() -> None:
    code = (
        "import sys, time; from e2efly.watch.beside import Shown\n"
        "shown = Shown(0, '--vehicle', 'vis_r'); print(shown.page._process.pid, flush=True); time.sleep(60)\n"
    )
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True) as program:
        assert program.stdout is not None
        viewer = int(program.stdout.readline())
        program.kill()
    try:
        for _ in range(600):
            if not Path(f"/proc/{viewer}").exists() or "Z" in Path(f"/proc/{viewer}/stat").read_text().split()[2]:
                return
            time.sleep(0.1)
        raise AssertionError("the viewer goes on")
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.kill(viewer, signal.SIGKILL)


def test_a_bridge_that_is_watched_imports_neither_jax_nor_the_viewer() -> None:
    code = "import sys, e2efly.watch.beside; sys.exit(any(name in sys.modules for name in ('jax', 'viser')))"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
