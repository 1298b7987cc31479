"""Debian's Chromium, headless: what the tests of pages, and a benchmark, look through."""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager

import pytest
from playwright.sync_api import Browser, sync_playwright

FLAGS = (
    "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-sync",
    "--disable-background-networking", "--disable-component-update", "--no-first-run",
)  # fmt: skip
"""It draws by software, and asks for nothing of its own."""


@contextmanager
def chromium() -> Iterator[Browser]:
    """A browser; the test fails where there is none."""
    path = shutil.which("chromium")
    if path is None:
        pytest.fail("needs chromium (Debian: apt-get install chromium); or E2EFLY_WITHOUT=browser to go without")
    with sync_playwright() as started:
        browser = started.chromium.launch(executable_path=path, args=list(FLAGS))
        try:
            yield browser
        finally:
            browser.close()
