"""`e2efly export`."""

import dataclasses
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro

from e2efly.commands.terminal import Terminal
from e2efly.config.storage import write_atomically
from e2efly.policy.c_export.header import Precision
from e2efly.policy.loader import load_policy
from e2efly.policy.raptor import HDF5, TAR
from e2efly.policy.zoo import beside, policy_file
from e2efly.simulation.device import prepare
from e2efly.vehicles.loading import load_vehicle
from e2efly.vehicles.vehicle_rules import check_quadrotor


@dataclass(frozen=True)
class Export:
    """Write policy.onnx from the checkpoint of a run, or a web page in which a policy flies, or a policy as C code, or
    for PX4's mc_raptor.
    """

    run: tyro.conf.Positional[Annotated[Path, tyro.conf.arg(metavar="RUN|POLICY")]]
    """A run directory, or a policy's name in the zoo (hover, any/hover). Or a policy.onnx from an older e2efly: it gets
    the digest that is checked on loading. Or a checkpoint of RAPTOR's form, .tar or .h5, that becomes a policy.onnx
    beside it."""
    out: Path | None = None
    """The file to write. If omitted, RUN/policy.onnx, or the older file itself. For a policy of the zoo,
    runs/zoo-TASK-VEHICLE/policy.onnx."""
    which: Literal["best", "last"] = "best"
    """The best policy by evaluation, or the last."""
    web: Path | None = None
    """Write a web page into this folder in which the run's policy.onnx flies. The browser simulates the vehicle and the
    task; wind, mass and delay can be changed. Open its index.html, or put the folder on any static web host."""
    vehicle: str | None = None
    """With --web: the vehicle that flies in the page. With --crazyflie: the vehicle whose mass and thrust count. A name
    or a .toml file. If omitted, the policy's own vehicle."""
    c: Path | None = None
    """Write the run's policy.onnx as C99 code into this folder, with its contract as a header and a program that checks
    and times it. The code depends only on <math.h> and allocates no memory. See docs/onboard.md."""
    raptor: Path | None = None
    """Write a policy that was trained by `hover --preset raptor` for PX4's module mc_raptor, to a name that ends with
    .tar, or for the Python package foundation-policy, to one that ends with .h5. See docs/onboard.md."""
    name: str = "policy"
    """With --c: the name for the files and the prefix of all symbols. With --raptor: the checkpoint's name."""
    precision: Precision | None = None
    """With --c: the precision of the network's computation. double: within 1e-6 of the exact result of the file. float:
    as near as ONNX Runtime, a few 1e-6, for processors that only compute in single precision. If omitted, double; with
    --crazyflie, float."""
    crazyflie: bool = False
    """With --c: also write an app of the Crazyflie's firmware that flies the policy on board. See docs/crazyflie.md."""
    memory: float | None = None
    """With --c: memory of the target for the policy's state and images, KiB. A policy that needs more is refused."""
    flash: float | None = None
    """With --c: read-only memory of the target for the policy's weights, KiB. A policy that needs more is refused."""


def run(options: Export) -> int:
    """Write policy.onnx from a checkpoint or from a file of an older e2efly, or a web page, or C code: see `Export`."""
    if options.c is not None:
        return _write_c(options, options.c)
    _without_effect(options, ("precision", "crazyflie", "memory", "flash"), "has no effect without --c")
    if options.raptor is not None:
        return _write_raptor(options, options.raptor)
    _without_effect(options, ("name",), "has no effect without --c or --raptor")
    if options.web is not None:
        return _write_page(options, options.web)
    if options.vehicle is not None:
        raise ValueError(
            f"--vehicle is {options.vehicle!r}; accepted: with --web or --crazyflie: policy.onnx names its own"
        )
    console, out = Terminal(), options.out
    if not options.run.exists() and options.run.suffix not in (TAR, HDF5):
        file = policy_file(options.run)
        path = out or beside(file) / "policy.onnx"
        _without_effect(options, ("which",), "has no effect on a policy of the zoo")
        path.parent.mkdir(parents=True, exist_ok=True)
        write_atomically(path, file.read_bytes())
        console.print(f"Wrote the zoo's policy {options.run} to {path}")
        return 0
    if options.run.suffix in (TAR, HDF5):
        prepare("cpu")
        from e2efly.learning.raptor_import import import_checkpoint

        path = out or options.run.with_suffix(".onnx")
        import_checkpoint(options.run, path)
        console.print(f"Wrote the policy of {options.run} to {path}")
        return 0
    if options.run.is_file():
        from e2efly.policy.loader import sealed_policy

        write_atomically(out or options.run, sealed_policy(options.run))
        console.print(f"Wrote {options.run} with its digest to {out or options.run}")
        return 0
    prepare("cpu")
    from e2efly.learning.onnx_export import contract_of, export_policy
    from e2efly.learning.point import load_policy_weights
    from e2efly.learning.setup import Setup
    from e2efly.runs.rundir import RunDirectory

    folder = RunDirectory(options.run)
    setup = Setup.of(folder.config())
    weights = load_policy_weights(folder.checkpoint, setup, options.which)
    path = out or folder.policy
    export_policy(path, weights, setup.actor, contract_of(setup.env, setup.config))
    console.print(f"Wrote the {options.which} policy of {options.run} to {path}")
    return 0


def _write_page(options: Export, folder: Path) -> int:
    why = "has no effect with --web: a page flies the policy.onnx that there is"
    _without_effect(options, ("out", "which"), why)
    prepare("cpu")
    from e2efly.validation.candidate import candidate
    from e2efly.viewing.web.page import write_page

    found = candidate(options.run, options.vehicle)
    write_page(folder, found)
    Terminal().print(f"Wrote a page that flies {found.file}: open {folder / 'index.html'}")
    return 0


def _write_c(options: Export, folder: Path) -> int:
    why = "has no effect with --c: the policy.onnx that there is becomes C"
    _without_effect(options, ("out", "which", "web", "raptor"), why)
    if options.vehicle is not None and not options.crazyflie:
        raise ValueError(f"--vehicle is {options.vehicle!r}; accepted: with --web or --crazyflie")
    from e2efly.policy.c_export.crazyflie_app import check_app, write_app
    from e2efly.policy.c_export.write import write_c

    file, name = policy_file(options.run), options.name
    contract = load_policy(file).contract
    vehicle = None
    if options.crazyflie:
        check_app(contract)
        if contract.vehicle_ranges is not None and options.vehicle is None:
            raise ValueError("--vehicle is left out; accepted: a name or .toml file, as the policy flies any vehicle")
        vehicle = load_vehicle(options.vehicle or contract.vehicle)
        check_quadrotor(vehicle, "--crazyflie")
    precision = options.precision or ("float" if options.crazyflie else "double")
    needs = write_c(folder, file, name, precision, options.memory, options.flash)
    console = Terminal()
    if vehicle is not None:
        write_app(folder, contract, name, vehicle)
        console.print(
            f"Wrote an app of the Crazyflie's firmware: {name}_app.c, Kbuild, app-config and Makefile. Build it: "
            f"make -C {folder} CRAZYFLIE_BASE=path/to/crazyflie-firmware"
        )
    console.print(f"Wrote {file} as C to {folder}: {name}.h, {name}.c and {name}_check.c")
    console.print(
        f"It needs {needs.state} bytes of state, {needs.images} of images and {needs.constants} of weights and tables. "
        f"Check it: cd {folder} && cc -O2 -std=c99 {name}.c {name}_check.c -lm -o check && ./check"
    )
    return 0


def _write_raptor(options: Export, path: Path) -> int:
    why = "has no effect with --raptor: the policy.onnx that there is becomes a checkpoint"
    _without_effect(options, ("out", "which", "web", "vehicle"), why)
    from e2efly.policy.loader import load_policy
    from e2efly.policy.raptor.raptor_checkpoint import write_checkpoint

    file = policy_file(options.run)
    write_checkpoint(path, load_policy(file), options.name)
    Terminal().print(f"Wrote {file} as the checkpoint {options.name} to {path}")
    return 0


def _without_effect(options: Export, names: tuple[str, ...], why: str) -> None:
    for field in dataclasses.fields(options):
        if field.name in names and (value := getattr(options, field.name)) != field.default:
            raise ValueError(f"--{field.name} is {str(value)!r}, which {why}; accepted: without it")
