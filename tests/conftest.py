"""Fixtures of the whole suite. The package computes in float32; a test that needs float64 asks for `x64`."""

import os
import shutil
import signal
import subprocess
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from e2efly.simulation import device

QUICK = (
    "--xla_backend_optimization_level=0 --xla_cpu_use_fusion_emitters=false --xla_cpu_parallel_codegen_split_count=1"
)
"""XLA options that halve the time of compilation, most of the suite's, to slower code.

What tests start has them where a test hands them on: where it waits for compilation, and not for what is compiled.
"""
os.environ["JAX_NUM_CPU_DEVICES"] = "2"
device.set_xla_options()  # as the commands do, before anything computes
_usual = os.environ["XLA_FLAGS"]
os.environ["XLA_FLAGS"] = f"{_usual} {QUICK}"

import jax  # noqa: E402

jax.devices()  # reads them
os.environ["XLA_FLAGS"] = _usual

# A suite that was started in the background ignores Ctrl-C or the end of its terminal, and so would all that it starts.
signal.signal(signal.SIGINT, signal.default_int_handler)
signal.signal(signal.SIGHUP, signal.SIG_DFL)

import pytest  # noqa: E402
from hypothesis import settings  # noqa: E402

from e2efly.vehicles.loading import load_vehicle  # noqa: E402
from e2efly.vehicles.vehicle import Vehicle  # noqa: E402

settings.register_profile("suite", deadline=None)  # how busy the machine is says nothing of the code
settings.load_profile("suite")

PARTS = ("ros1", "ros2", "mocap", "realsense", "sitl", "browser", "cc")
"""What may be missing on a laptop: tests in files whose names end so need it, and fail without it."""
LONGEST = (
    "docs/test_tutorials.py", "docs/test_notebooks.py", "learning/test_paper.py",
    "alignment/test_identification.py", "learning/test_runner.py", "learning/test_hosts.py", "commands/test_sweep.py",
    "policy/test_zoo.py", "learning/test_ablation.py", "learning/test_algorithms.py", "validation/test_faults_sitl.py",
    "validation/test_campaign_sitl.py", "test_examples.py", "adapters/test_torch.py", "simulation/scenes/test_cast.py",
    "viewing/web/test_page_browser.py",
)  # fmt: skip
"""Files that take a minute or so, the longest first: they begin, so that of two workers neither ends long alone."""
WITHOUT = tuple(filter(None, os.environ.get("E2EFLY_WITHOUT", "").split(",")))
"""Parts whose tests are left out by the environment's word, which the summary repeats."""


@pytest.fixture(scope="module", autouse=True)
def _programs_go() -> Iterator[None]:
    """A file's compiled programs go with it: all together they are many gigabytes."""
    yield
    jax.clear_caches()


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """No options for single programs: QUICK compiles sooner than `fast_compile` does. For runs of a few updates."""
    monkeypatch.setattr(device, "FAST_COMPILE", {})


@pytest.fixture(scope="session")
def vis_r() -> Vehicle:
    return load_vehicle("vis_r")


@pytest.fixture
def x64() -> Iterator[None]:
    with jax.enable_x64(True):
        yield


@dataclass(frozen=True)
class NetworkTrace:
    """What the processes that a test starts tried to send off this machine; it is refused, too.

    A library loaded into them does it, rather than strace: it needs no tool but gcc, which the firmware needs as well,
    no permission to trace, and it sees ONNX Runtime's own client, which Python's audit hooks do not.
    """

    file: Path

    def left(self) -> list[str]:
        """A line for each try."""
        return self.file.read_text().splitlines() if self.file.exists() else []


@pytest.fixture(scope="session")
def network_library(tmp_path_factory: pytest.TempPathFactory) -> Path | None:
    """The built library; None where the tests that need a compiler are left out."""
    if "sitl" in WITHOUT:
        return None
    if not shutil.which("gcc"):
        pytest.fail("needs gcc (Debian: apt-get install gcc); or E2EFLY_WITHOUT=sitl to go without")
    built = tmp_path_factory.mktemp("network") / "network_trace.so"
    source = Path(__file__).with_name("network_trace.c")
    subprocess.run(["gcc", "-O2", "-Wall", "-Werror", "-shared", "-fPIC", "-o", built, source, "-ldl"], check=True)
    return built


@pytest.fixture
def network(network_library: Path | None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> NetworkTrace:
    """Watches what is started from here on."""
    trace = NetworkTrace(tmp_path / "network.txt")
    if network_library is not None:
        monkeypatch.setenv("LD_PRELOAD", str(network_library))
        monkeypatch.setenv("E2EFLY_NETWORK_TRACE", str(trace.file))
    return trace


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--whole", action="store_true", help="all tests, also those that `make test` leaves out")
    parser.addoption("--rest", action="store_true", help="the tests of which `make test` leaves cases out, alone")


def pytest_configure(config: pytest.Config) -> None:
    del config
    if wrong := set(WITHOUT) - set(PARTS):
        raise pytest.UsageError(f"E2EFLY_WITHOUT names {', '.join(sorted(wrong))}; accepted: {', '.join(PARTS)}")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    here = Path(__file__).parent
    named = any((config.rootpath / argument).resolve() != here for argument in config.args)  # and these are run
    whole = set(_of_the_whole(items))
    if config.getoption("--rest"):
        left_out = {item for item in items if item.get_closest_marker("whole") is None}  # cases may build on the first
    elif named or config.getoption("--whole"):
        left_out = set()
    else:
        left_out = whole
        folders = [{item.path.parent for item in items if item not in of} for of in (set(), whole)]
        if alone := folders[0] - folders[1]:
            raise pytest.UsageError(f"every test is `whole` in {', '.join(map(str, alone))}; accepted: one that is not")
    out = left_out | {item for item in items if item.path.stem.endswith(tuple(f"_{part}" for part in WITHOUT))}
    if out:
        config.hook.pytest_deselected(items=[*out])
        items[:] = [item for item in items if item not in out]
    place = {here / name: i for i, name in enumerate(LONGEST)}
    items.sort(key=lambda item: place.get(item.path, len(LONGEST)))


def _of_the_whole(items: list[pytest.Item]) -> list[pytest.Item]:
    """The tests that the short suite leaves out: those marked `whole`, but for their first cases."""
    seen, later = Counter[str](), []
    for item in items:
        if (mark := item.get_closest_marker("whole")) is None:
            continue
        test = item.nodeid.partition("[")[0]
        seen[test] += 1
        if seen[test] > mark.kwargs.get("but", 0):
            later.append(item)
    return later


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    if WITHOUT:
        terminalreporter.write_line(f"WITHOUT the tests of: {', '.join(WITHOUT)} (E2EFLY_WITHOUT)", yellow=True)
