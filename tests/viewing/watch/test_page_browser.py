"""The viewer's page in a real browser: Debian's Chromium, headless."""

import json
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

from e2efly.logs.telemetry import Telemetry
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


@pytest.mark.whole
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


@pytest.mark.whole
def test_a_browser_that_goes_away_does_not_end_the_viewer() -> None:
    wrong: list[str] = []
    with served("hover") as (process, address):
        with page_of(address, wrong) as page:
            wait_for(page, "/from its goal/.test(text)")
        with page_of(address, wrong) as page:
            wait_for(page, "/from its goal/.test(text)")
        assert process.poll() is None
    assert wrong == []


@pytest.mark.whole
def test_a_validation_is_watched(tmp_path: Path) -> None:
    report = str(tmp_path / "report.json")
    asked = ["--plant", "mujoco", "--episodes", "2", "--max-drop", "100", "--out", str(tmp_path), "--json", report]
    subprocess.run([sys.executable, "-m", "e2efly", "validate", "race", *asked], check=True, capture_output=True)
    wrong: list[str] = []
    with served(report) as (process, address), page_of(address, wrong) as page:
        wait_for(page, "/race \\d on mujoco/.test(text)")
        page.wait_for_timeout(1500)
        page.screenshot(path=tmp_path / "page.png")
        assert "Start" in page.inner_text("body")
        assert process.poll() is None
    assert wrong == []
    picture = np.asarray(Image.open(tmp_path / "page.png").convert("RGB"), float)
    assert picture[:, :500].std() > 5


@pytest.mark.whole
def test_what_a_log_says_is_shown_as_text_and_not_run(tmp_path: Path) -> None:
    frame = "<iframe srcdoc='<script>parent.ran = true<&#47;script>'>"
    said = [frame, "<img src=/x onerror='ran = true'>", "{globalThis.ran = true}", "![x](/y) **bold** &lt; a_b_c"]
    path = tmp_path / f"{frame}.mcap"
    with Telemetry(path) as log:
        start = time.monotonic()
        for i in range(10 * len(said)):
            pose = {"position": [0.01 * i, 0.0, 1.0], "quaternion": [1.0, 0.0, 0.0, 0.0]}
            log.record("odometry", start + 0.1 * i, {**pose, "velocity": [0.0] * 3, "body_rate": [0.0] * 3})
            if i % 10 == 0:
                mode = said[i // 10]
                log.record("mode", start + 0.1 * i, {"mode": mode, "previous": mode, "reasons": [mode]})
    wrong: list[str] = []
    with served(str(path)) as (_, address), page_of(address, wrong) as page:
        for mode in said:
            wait_for(page, f"globalThis.ran || text.includes({json.dumps(f'{path.name} {mode}')})")
        assert page.evaluate("globalThis.ran") is None
    assert wrong == []
