"""How programs are compiled."""

import subprocess
import sys
from pathlib import Path

import pytest
from jax._src import compilation_cache

from e2efly.simulation.compiled import check_programs
from e2efly.simulation.device import processor, programs_folder, unless_said, wide_vectors

GRADIENT = """
import dataclasses, resource
from e2efly.simulation.device import set_xla_options
set_xla_options()
from e2efly.runs import presets
from e2efly.learning.programs import Programs
from e2efly.learning.setup import Setup
config = presets.preset("hover", "bptt")
algo = dataclasses.replace(config.algo, envs=16, horizon=16)
setup = Setup.of(dataclasses.replace(config, algo=algo, chunk=2, eval_episodes=20, devices=1))
parameters = setup.algorithm.init(setup.env, algo, 0)
resource.setrlimit(resource.RLIMIT_DATA, (2 << 30, 2 << 30))
Programs.compile(setup, parameters)
"""


@pytest.mark.whole
def test_the_gradient_of_a_few_vehicles_compiles_in_little_memory(tmp_path: Path) -> None:
    file = tmp_path / "gradient.py"
    file.write_text(GRADIENT)
    done = subprocess.run([sys.executable, str(file)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


BEGUN = """
import jax.numpy as jnp
jnp.zeros(3) + 1
import e2efly
state, _ = e2efly.make_env("hover").reset(__import__("jax").random.key(0), 2)
from e2efly.simulation.device import prepare
prepare()
"""


def test_who_has_computed_with_jax_before_goes_on_with_the_devices_there_are() -> None:
    done = subprocess.run([sys.executable, "-c", BEGUN], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


DAMAGED = """
import sys
from pathlib import Path
from e2efly.simulation.device import prepare
prepare("cpu")
import jax, jax.numpy as jnp
jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)
def computed():
    jax.clear_caches()
    return float(jax.jit(lambda x: jnp.sum(jnp.sin(x) * 3))(jnp.arange(5.0)))
first = computed()
(file,) = Path(sys.argv[1]).glob("e2efly/programs/jit__lambda*-cache")
whole = file.read_bytes()
assert computed() == first
for damaged in (whole[:1000] + bytes([whole[1000] ^ 16]) + whole[1001:], whole[:-20], b""):
    file.write_bytes(damaged)
    assert computed() == first
    print(file)
    assert len(file.read_bytes()) > 1000
"""


def test_a_damaged_compiled_program_is_told_of_and_compiled_anew(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without its digest, one flipped bit crashes the process, or computes something else."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    done = subprocess.run([sys.executable, "-c", DAMAGED, str(tmp_path)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    files = done.stdout.splitlines()
    assert len(files) == 3
    assert done.stderr.splitlines() == [f"{file} is damaged: its program is compiled anew" for file in files]


def test_a_cache_that_the_user_names_stays_in_jaxs_own_format(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compilation_cache, "get_file_cache", compilation_cache.get_file_cache)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    check_programs(programs_folder)
    for folder, checked in ((programs_folder(), True), (tmp_path / "shared", False)):
        cache, _ = compilation_cache.get_file_cache(str(folder))
        cache.put("key", b"program")
        assert cache.get("key") == b"program"
        assert ((folder / "key-cache").read_bytes() == b"program") is not checked


def test_many_vehicles_have_wide_vectors() -> None:
    assert wide_vectors(17) == {"xla_cpu_prefer_vector_width": 512}
    assert wide_vectors(16) == {}


def test_what_the_user_says_of_vectors_stays(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XLA_FLAGS", "--xla_cpu_prefer_vector_width=256")
    assert wide_vectors(100) == {}


def test_what_the_user_says_of_other_options_stays(monkeypatch: pytest.MonkeyPatch) -> None:
    options = {"xla_backend_optimization_level": 1, "xla_cpu_use_fusion_emitters": False}
    monkeypatch.setenv("XLA_FLAGS", "--xla_backend_optimization_level=3 --xla_cpu_use_fusion")
    assert unless_said(options) == {"xla_cpu_use_fusion_emitters": False}
    monkeypatch.delenv("XLA_FLAGS")
    assert unless_said(options) == options


def test_the_processor_and_whether_it_has_avx_512() -> None:
    told = "processor : 0\nmodel name : A: B\nflags : fpu avx2{}\n"
    assert processor(told.format(" avx512f avx512dq")) == ("A: B", True)
    assert processor(told.format("")) == ("A: B", False)
    assert processor("")[1] is None
