"""Make docs/gpu.md from benchmarks/results/gpu.json and gpu_programs.json: `make docs`."""

import json
from pathlib import Path
from typing import Any

from e2efly.commands.terminal import markdown
from e2efly.runs import sizes

DOCS = Path(__file__).parent
RESULTS = DOCS.parent / "benchmarks" / "results"
HEAD = f"""# On a GPU

    pip install 'e2efly[cuda]'
    e2efly train hover                     # computes on the GPU, with the preset's sizes for a GPU
    e2efly train hover --device cpu        # the same command as on a machine without a GPU

No command needs a GPU. `train` uses one if JAX's package for CUDA is installed and NVIDIA's driver has a GPU for the
process. JAX's own variable `JAX_PLATFORMS` goes before that, and `--device` before everything. A run that was sized for
a GPU never falls back to a CPU: it ends with an error that names the reason.

## Sizes
On a GPU an update takes nearly as long with 64 environments as with thousands. The presets therefore have other sizes
there:

| | on a CPU | on a GPU |
| --- | --- | --- |
| environments | 32 or 64 | {sizes.PLAIN:,}; with a memory, or another course in every episode: {sizes.MEMORY:,}; with \
cameras: {sizes.SIGHT:,} |
| minibatch of PPO | 512 | as many times larger as there are more environments, so that an update has as many gradient \
steps |
| updates | those of the preset | half, at most {sizes.ENOUGH}, or a quarter if that is more; the environment steps \
follow from that |
| stages of a curriculum | those of the preset | the same share of the run |
| updates between two evaluations | those of the preset | the same, or fewer, so that a run has \
{sizes.EVALUATIONS} evaluations or more |
| starts per evaluation | 250 | 1000 ({sizes.MORE_STARTS} times those of the preset) |
| learning rates | those of the preset | the same |

The environments are those with which training was measured on a GPU (below). The number of updates is chosen, not
measured: on a CPU the preset `nominal` of hover, land, track and race reaches its criterion within 210 updates
([times](benchmarks.md#time-to-the-criterion-from-process-start)), and in long runs noise decides, which more
environments take away: `race --task.track any` and `avoid` took a quarter of the updates on a GPU. No preset needs
more than 2 GB of the card's memory, by the estimate that `train` makes before it begins. Presets that state the
conditions of a published result (`paper`, `authors`) are the same on every device, and so are the sizes of `shac`,
`abpt`, `foppo` and `dagger`, which nobody has measured on a GPU. `ablate` trains its members side by side, which fills
a GPU, with the sizes for a CPU.

What you say goes before the preset: `--algo.envs 512` is 512 on every device. A run keeps its sizes in `config.json`.
`--resume DIR` goes on with them on any device, and `--config FILE` takes those of the file. `sweep --gpus 1` trains
with the sizes for a GPU, and without `--gpus` with those for a CPU. In Python, `e2efly.train` does as the command
does, and `e2efly.preset(..., device="gpu")` gives the configuration.

## Figures
"""
UNSEEN = """
**No GPU has run the package since then**: neither the sizes above nor `benchmarks/gpu.py`. That script measures all
of this anew, in at most eight minutes, wherever a GPU is, and replaces the table.
""".strip()
"""What stands over figures that the script has not measured."""
SPENT = """
## What an update spends
On the H200, on 2026-11-27, an update of BPTT took 37 ms with 64 environments and 50 ms with 16,384. The time goes
into launches of small kernels, not into arithmetic. The loops over updates, steps and physics sub-steps are loops in
the program for a GPU, too: nothing is unrolled (a test holds that). But every step is hundreds of kernels, and many
of those of BPTT's forward pass only store a number for the backward pass.
"""
COMPILED = """
A chunk of updates of the preset `nominal`, in its sizes for a GPU, compiled for an {card}: neither a card nor its
driver is needed for that. Launches are counted in the optimised program. The seconds are those of all cores together;
XLA spreads most of them over the cores of the machine. Measured by `benchmarks/gpu_programs.py`, {date}, {place}.
"""
AFTER = """
With `--fast-compile` (the default of all presets but those of `avoid` and `race_clutter`) matrix products are
cuBLAS's, which are ready. Otherwise XLA compiles and times dozens of kernels for each product. That search needs a
card, so its seconds are in no figure of this page but those of the whole commands. The second run of a training finds
its programs in the cache, as on a CPU.

## How near the limit
A third-order physics sub-step has about 450 floating-point operations. An H200 does 67 T of them per second if each
multiplication has its addition, and perhaps two thirds as many in formulas like these. So its arithmetic would allow
some 100 G sub-steps per second. 13.1 G were measured on 2026-11-27: 13 % of that.

Not the arithmetic is in the way, but probably the memory. XLA makes two kernels of a sub-step, and each reads and
writes the state of every vehicle, 17 numbers of 4 bytes: some 270 bytes per sub-step. At 13.1 G sub-steps per second
these are 3.6 TB/s, of the 4.8 TB/s that the card has. A kernel that keeps a vehicle's state in registers over all
sub-steps of a control step would be limited by the arithmetic. It does not exist.
"""


def table_of(name: str) -> tuple[dict[str, Any], list[str]]:
    """A file of results, and the lines of its table."""
    content = json.loads((RESULTS / f"{name}.json").read_text(encoding="utf-8"))
    return content, markdown(content["table"])


def page() -> str:
    """The page."""
    measured, figures = table_of("gpu")
    programs, counts = table_of("gpu_programs")
    m, there = measured["machine"], programs["machine"]
    place = f"{there['cores']} cores of {there['cpu']}, JAX {there['jax']}"
    lines = [f"{measured['card']}, JAX {m['jax']}, Python {m['python']}, {measured['date']}, by {measured['by']}."]
    if measured["by"] != "benchmarks/gpu.py":
        lines += ["", *UNSEEN.splitlines()]
    lines += ["", *figures, "", *(f"Not measured: {missing}." for missing in measured["not_measured"]), ""]
    compiled = COMPILED.format(card=programs["card"], date=programs["date"], place=place)
    return "\n".join([HEAD, *lines]) + "\n".join([SPENT + compiled, *counts, AFTER.rstrip(), ""])


if __name__ == "__main__":
    (DOCS / "gpu.md").write_text(page(), encoding="utf-8")
