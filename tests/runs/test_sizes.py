"""Presets on a GPU: their sizes, and who decides them. No GPU is needed."""

import dataclasses
import json
from pathlib import Path
from typing import Any

import jax
import pytest

from e2efly.commands.train import parse
from e2efly.config import TrainConfig
from e2efly.runs import presets
from e2efly.runs.inputs import to_json
from e2efly.runs.paper import NAMES
from e2efly.runs.rundir import RunDirectory
from e2efly.runs.sizes import environments, for_device
from e2efly.simulation import device
from e2efly.simulation.device import FAST_COMPILE, device_kind
from e2efly.tasks import TASKS


def known() -> list[tuple[str, str, str]]:
    """Every task, algorithm and preset with sizes of its own on a GPU."""
    return [
        (name, algo, preset)
        for name, task in TASKS.items()
        for algo in ("ppo", "bptt")
        for preset in (presets.NOMINAL, *task.variants, *([presets.ROBUST] if algo in task.robust else []))
        if (algo, preset) not in (("ppo", "rotors"), ("ppo", "raptor"), ("ppo", "lost_rotor"))
    ]


@pytest.mark.parametrize(("task", "algo", "preset"), known())
def test_a_preset_on_a_gpu_has_more_environments_and_as_many_gradient_steps(task: str, algo: str, preset: str) -> None:
    cpu: Any = presets.starting(task, algo, preset)
    gpu: Any = presets.starting(task, algo, preset, device="gpu")
    assert for_device(cpu, preset, "cpu") is cpu
    presets.check(gpu)
    factor = gpu.algo.envs // cpu.algo.envs
    assert gpu.algo.envs == factor * cpu.algo.envs == environments(cpu)
    per_update = [config.algo.steps / getattr(config.algo, "minibatch", config.algo.steps) for config in (cpu, gpu)]
    assert per_update[0] == per_update[1]
    updates = [config.steps // config.algo.steps for config in (cpu, gpu)]
    wanted = updates[0] / 4 if updates[0] > 1200 else min(updates[0] / 2, 300)
    assert abs(updates[1] - wanted) <= 1
    assert updates[1] // gpu.chunk >= 10
    stages = [[stage.steps / config.steps for stage in config.curriculum] for config in (cpu, gpu)]
    assert stages[1] == pytest.approx(stages[0], rel=1e-3)
    same: tuple[Any, ...] = cpu.task, cpu.reward, cpu.env, cpu.network, cpu.algo.learning_rate
    assert same == (gpu.task, gpu.reward, gpu.env, gpu.network, gpu.algo.learning_rate)


@pytest.mark.parametrize("preset", [name for name in NAMES if name in presets.names()])
def test_the_conditions_of_a_result_are_the_same_on_every_device(preset: str) -> None:
    assert presets.starting("hover", "ppo", preset, device="gpu") == presets.preset("hover", "ppo", preset)


def asked(*arguments: str) -> tuple[TrainConfig, str | None]:
    found = parse(list(arguments))
    return found.config, found.device


def test_what_is_said_goes_before_the_sizes_of_a_device(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("JAX_PLATFORMS", "cuda,cpu")
    config, where = asked("hover", "--algo.envs", "512", "--steps", "1e6")
    assert (config.algo.envs, config.steps, where) == (512, 1_000_000, "gpu")
    config, where = asked("hover", "--device", "cpu")
    assert config == presets.preset("hover", "bptt", presets.ROBUST)
    assert where == "cpu"


def test_a_file_and_a_run_keep_their_sizes_on_every_device(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("JAX_PLATFORMS", "cuda,cpu")
    config = presets.preset("hover", "bptt")
    file, run = tmp_path / "config.json", RunDirectory(tmp_path / "run")
    file.write_text(json.dumps(to_json(config)))
    run.create(config)
    assert asked("--config", str(file)) == (config, None)
    resumed, where = asked("--resume", str(run.path))
    assert (resumed.algo, resumed.steps, resumed.chunk, where) == (config.algo, config.steps, config.chunk, None)


def test_the_device_is_known_without_jax(monkeypatch: pytest.MonkeyPatch) -> None:
    @dataclasses.dataclass(frozen=True)
    class Plugin:
        name: str

    monkeypatch.setattr(device.metadata, "entry_points", lambda group: [Plugin("xla_cuda12")])
    for platforms, gpus, kind in (("", 1, "gpu"), ("", 0, "cpu"), ("cpu", 1, "cpu"), ("cuda,cpu", 0, "gpu")):
        monkeypatch.setenv("JAX_PLATFORMS", platforms)
        monkeypatch.setattr(device, "_gpus", lambda count=gpus: count)
        assert device_kind() == kind
        assert [device_kind(asked) for asked in ("cpu", "gpu")] == ["cpu", "gpu"]
    monkeypatch.setenv("JAX_PLATFORMS", "")
    monkeypatch.setattr(device, "_gpus", lambda: 1)
    monkeypatch.setattr(device.metadata, "entry_points", lambda group: [Plugin("xla_tpu")])
    assert device_kind() == "cpu"


def test_jax_knows_the_options_of_both_devices(monkeypatch: pytest.MonkeyPatch) -> None:
    program = jax.jit(lambda x: x + 1).lower(1.0)
    monkeypatch.setenv("XLA_FLAGS", "")
    for backend in ("cpu", "gpu", "tpu"):
        monkeypatch.setattr(jax, "default_backend", lambda backend=backend: backend)
        assert device.fast_compile() == FAST_COMPILE.get(backend, {})
        program.compile(compiler_options=device.fast_compile())
    with pytest.raises(jax.errors.JaxRuntimeError, match="xla_gpu_no_such_option"):
        program.compile(compiler_options={"xla_gpu_no_such_option": 0})
