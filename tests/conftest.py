"""Fixtures of the whole suite. The package computes in float32; a test that needs float64 asks for `x64`."""

import os
from collections.abc import Iterator

from e2efly.device import set_xla_options

QUICK = "--xla_backend_optimization_level=0 --xla_cpu_use_fusion_emitters=false"
"""XLA options that halve the time of compilation, most of the suite's, to slower code. Not for what tests start."""
os.environ["JAX_NUM_CPU_DEVICES"] = "2"
set_xla_options()  # as the commands do, before anything computes
_usual = os.environ["XLA_FLAGS"]
os.environ["XLA_FLAGS"] = f"{_usual} {QUICK}"

import jax  # noqa: E402

jax.devices()  # reads them
os.environ["XLA_FLAGS"] = _usual

import pytest  # noqa: E402
from hypothesis import settings  # noqa: E402

settings.register_profile("suite", deadline=None)  # how busy the machine is says nothing of the code
settings.load_profile("suite")

PARTS = ("ros1", "ros2", "mocap", "sitl")
"""What may be missing on a laptop: tests in files whose names end so need it, and fail without it."""
WITHOUT = tuple(filter(None, os.environ.get("E2EFLY_WITHOUT", "").split(",")))
"""Parts whose tests are left out by the environment's word, which the summary repeats."""


@pytest.fixture(scope="module", autouse=True)
def _programs_go() -> Iterator[None]:
    """A file's compiled programs go with it: all together they are many gigabytes."""
    yield
    jax.clear_caches()


@pytest.fixture
def x64() -> Iterator[None]:
    with jax.enable_x64(True):
        yield


def pytest_configure(config: pytest.Config) -> None:
    del config
    if wrong := set(WITHOUT) - set(PARTS):
        raise pytest.UsageError(f"E2EFLY_WITHOUT names {', '.join(sorted(wrong))}; accepted: {', '.join(PARTS)}")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    out = [item for item in items if item.path.stem.endswith(tuple(f"_{part}" for part in WITHOUT))]
    if out:
        config.hook.pytest_deselected(items=out)
        items[:] = [item for item in items if item not in out]


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    if WITHOUT:
        terminalreporter.write_line(f"WITHOUT the tests of: {', '.join(WITHOUT)} (E2EFLY_WITHOUT)", yellow=True)
