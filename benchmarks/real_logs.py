"""Identification from logs of real flights, which are not part of this repository.

    python benchmarks/real_logs.py --logs FOLDER [--vehicle crazyflie]

FOLDER holds `arplab/log10` and `arplab/log15` (Crazyflie 2.x, 1 kHz, of data-driven-system-identification by the
arplaboratory) and `nanobench/*.csv` (Crazyflie 2.1, 100 Hz with motion capture, of nanobench-iros2026 by syediu).

The first are fitted together, every fifth window kept out. Of the second, every flight is foretold by the fit of those
that follow other trajectories: with its measured attitude, from its measured position and velocity, by thrust from
the motors' voltage and by drag; then once more with tilt and thrust scale from its first 10 s.
"""

import dataclasses
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from common import arguments, table, write

from e2efly.alignment.checks import checked
from e2efly.alignment.identification import Found, identify
from e2efly.alignment.model import FACTOR, GYRO, NUISANCES, START, Model, simulate
from e2efly.alignment.prediction import judged
from e2efly.alignment.shooting import measured_starts
from e2efly.alignment.vehicle_file import merged
from e2efly.alignment.windows import STEP, Windows, cut, join
from e2efly.logs.csv_file import column_map
from e2efly.logs.readers import LogReading, read_part
from e2efly.logs.recording import Record, Stream
from e2efly.simulation.device import prepare
from e2efly.vehicles.loading import load_vehicle
from e2efly.vehicles.vehicle import Vehicle

PARTS = ("log15:15.8-50.8", "log10:8.7-38.7")
COLUMNS = (
    "wx=imu_gyro_x", "wy=imu_gyro_y", "wz=imu_gyro_z", "ax=imu_acc_x*9.80665", "ay=imu_acc_y*9.80665",
    "az=imu_acc_z*9.80665", "m1=motor_motor_m2*1.5259e-5", "m2=motor_motor_m1*1.5259e-5",
    "m3=motor_motor_m3*1.5259e-5", "m4=motor_motor_m4*1.5259e-5", "volts=pwr_pm_vbat",
)  # fmt: skip
CORRUPT = "B2_circle_medium_rep3"
"""Of which splines overshoot; it must be refused."""
AHEAD = (0.5, 1.0, 2.0)
"""How far ahead positions are foretold, s."""
SHIFTS = 4
"""Sets of windows, one shifted by this part of a window against the other."""
POSE_DELAY, TILT = 6, slice(7, 9)
"""Places in `NUISANCES` of what belongs to the poses."""
OWN = 10.0
"""Seconds of a flight that tell its own tilt and thrust scale."""


def crazyflie(folder: Path, vehicle: Vehicle) -> list[dict[str, Any]]:
    """Lag, thrust, inertia and rates of the logs at 1 kHz."""
    records = checked([record for part in PARTS for record in read_part(folder / part)], vehicle)
    found = identify(vehicle, records)
    names = [u.name for u in found.model.unknowns]
    new = merged(vehicle, {e.name: e for e in found.estimates})
    sigma = dict(zip(names, found.sigma, strict=True))
    plain = found.structures["without delay"][names.index("motor_time_constant")]
    half_lost = float(np.mean(found.fit.q[:, 9])) / 2
    seen = judged(found)
    windows = found.windows.some(found.held_out)
    step = round(0.048 / STEP)
    rate = {
        label: float(np.sqrt(np.mean((guess[:, step, :2] - windows.measured["body_rate"][:, step, :2]) ** 2)))
        for label, guess in (("file", seen.old["body_rate"]), ("identified", seen.new["body_rate"]))
    }
    gone = windows.measured["body_rate"][:, step, :2] - windows.measured["body_rate"][:, 0, :2]
    rate["held"] = float(np.sqrt(np.mean(gone**2)))

    def row(what: str, value: str) -> dict[str, Any]:
        return {"Crazyflie at 1 kHz": what, "found": value}

    return [
        row("motor lag, without a delay in the model", f"{vehicle.motor_time_constant * np.exp(plain):.3f} s"),
        row("motor lag, and delay", f"{new.motor_time_constant:.3f} s, {new.latency:.3f} s"),
        row(
            "largest thrust of a rotor, full battery",
            f"{new.rotor_thrust_max:.4f} +- {sigma['thrust'] * new.rotor_thrust_max:.4f} N",
        ),
        row("the same, middle of the flights", f"{new.rotor_thrust_max * (1 - half_lost):.4f} N"),
        *(
            row(f"J{axis}", f"{1e5 * new.inertia[i]:.2f}e-5 kg m^2 +- {100 * sigma[f'inertia_{axis}']:.0f} %")
            for i, axis in enumerate("xy")
        ),
        row(
            "roll and pitch rate 48 ms ahead, RMS an axis",
            f"{rate['identified']:.2f} rad/s (file {rate['file']:.2f}, held {rate['held']:.2f})",
        ),
    ]


def prescribed(record: Record) -> Record:
    """With the body rates by which its attitudes go over into each other, in the place of the gyroscope's."""
    pose = record.streams["quaternion"]
    a, b = pose.values[:-1], pose.values[1:]
    w = np.sum(a * b, -1)
    x = a[:, :1] * b[:, 1:] - b[:, :1] * a[:, 1:] - np.cross(a[:, 1:], b[:, 1:])
    dt = np.diff(pose.time)
    rates = 2 * x * np.sign(w)[:, None] / dt[:, None]
    return dataclasses.replace(record, streams={**record.streams, "body_rate": Stream(pose.time[:-1] + dt / 2, rates)})


def foretold(record: Record, volts: float | None) -> Windows:
    """Windows of two seconds, each begun a quarter of that after the one before it."""
    start, end = record.span
    length = AHEAD[-1]
    sets = [
        cut(record.during(start + length * i / SHIFTS, end), "motor_and_rate", 0, volts, length) for i in range(SHIFTS)
    ]
    return join(sets)


@partial(jax.jit, static_argnums=())
def _positions(model: Model, p: Any, q: Any, data: dict[str, Any]) -> Any:
    start = jnp.zeros(START).at[6:8].set(-q[TILT])

    def one(window: dict[str, Any]) -> Any:
        return simulate(model, p, q, start, window)["position"]

    return jax.vmap(one)(data)


def errors(model: Model, p: np.ndarray, q: np.ndarray, windows: Windows, at: Sequence[float]) -> np.ndarray:
    """Of the positions, (n, times, 3) m."""
    steps = [round(t / STEP) - 1 for t in at]  # the poses lie at every other point or so: the nearest before
    with jax.enable_x64(True):
        seen = np.asarray(_positions(model, p, q, measured_starts(model, windows)))
    out = []
    for step in steps:
        there = windows.there["position"]
        near = np.array([max(np.flatnonzero(t[: step + 2])) for t in there])
        rows = np.arange(len(near))
        out.append(seen[rows, near] - windows.measured["position"][rows, near])
    return np.stack(out, 1)


def own_nuisances(found: Found, q: np.ndarray, windows: Windows) -> np.ndarray:
    """With tilt and thrust scale that explain these windows best, by Gauss-Newton; priors are those of the fit."""
    free = [7, 8, FACTOR]
    prior = np.array([0.03, 0.03, 0.05])
    q = q.copy()
    centre = q[free].copy()
    for _ in range(4):
        r = errors(found.model, found.p, q, windows, AHEAD[:2])[:, 1].ravel() / 0.1
        J = []
        for i in free:
            moved = q.copy()
            moved[i] += 1e-4
            J.append((errors(found.model, found.p, moved, windows, AHEAD[:2])[:, 1].ravel() / 0.1 - r) / 1e-4)
        A = np.stack(J, -1)
        off = q[free] - centre
        q[free] -= np.linalg.solve(A.T @ A + np.diag(prior**-2.0), A.T @ r + off / prior**2)
    return q


def nanobench(folder: Path, vehicle: Vehicle) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """Positions 0.5, 1 and 2 s ahead of every flight, by the fit of those along other trajectories."""
    reading = LogReading(column_map(COLUMNS))
    records, refused = [], ""
    for path in sorted(folder.glob("*.csv")):
        try:
            records += checked(read_part(path, reading), vehicle)
        except ValueError as error:
            refused = str(error).removeprefix(f"{path.parent}/")
            if path.stem != CORRUPT:
                raise
    volts = float(np.median([np.median(r.streams["voltage"].values) for r in records]))
    fits: dict[str, Found] = {}
    rows = []
    for record in records:
        kind = record.path.stem.split("_")[1]
        if kind not in fits:
            fits[kind] = identify(vehicle, [r for r in records if r.path.stem.split("_")[1] != kind], volts=volts)
        found = fits[kind]
        q = found.fit.q.mean(0)
        q[GYRO], q[POSE_DELAY] = 0.0, 0.0  # the poses alone say where a window starts and how it turns
        hover = _scaled_to_hover(found)
        flight = prescribed(record)
        start, end = flight.span
        whole, later = foretold(flight, volts), foretold(flight.during(start + OWN, end), volts)
        own = own_nuisances(found, q, foretold(flight.during(start, start + OWN), volts))

        def told(e: np.ndarray) -> list[float]:
            return np.linalg.norm(e, axis=-1).mean(0).tolist()

        rows.append({
            "flight": record.path.stem,
            "file, scaled to hover": told(errors(found.model, hover, np.zeros(len(NUISANCES)), whole, AHEAD)),
            "identified": told(errors(found.model, found.p, q, whole, AHEAD)),
            "with own tilt and scale": told(errors(found.model, found.p, own, later, AHEAD)),
        })  # fmt: skip
        print(rows[-1], own[[7, 8, FACTOR]], flush=True)
    mean = {k: np.mean([r[k] for r in rows], 0).tolist() for k in rows[0] if k != "flight"}
    rows.append({"flight": "mean", **mean})

    def said(x: Any) -> Any:
        return " / ".join(f"{v:.3f}" for v in x) if isinstance(x, list) else x

    print("refused:", refused)
    return rows, [{k: said(x) for k, x in row.items()} for row in rows]


def _scaled_to_hover(found: Found) -> np.ndarray:
    """The file's vehicle, its thrust such that the mean output of the flights carries it."""
    mean = np.median(np.diff(found.windows.driven[:, :, :4], axis=1)) / STEP
    base = found.model.base
    top = 4 * float(base.rotor_thrust_max) * mean * (0.5 + 0.5 * mean)
    p = np.zeros(len(found.p))
    p[[u.name for u in found.model.unknowns].index("thrust")] = np.log(float(base.mass) * 9.80665 / top)
    return p


def main() -> None:
    """Fit both sets of logs, print what comes out, write JSON."""
    options = arguments(__doc__ or "", logs="", vehicle="crazyflie")
    if not options.logs:
        raise SystemExit("--logs is missing; accepted: the folder with arplab and nanobench in it")
    prepare("cpu")
    folder, vehicle = Path(options.logs), load_vehicle(options.vehicle)
    first = crazyflie(folder / "arplab", vehicle)
    print(table(first))
    rows, shown = nanobench(folder / "nanobench", vehicle)
    write("real_logs", options.json, {"crazyflie": first, "nanobench": rows})
    print(f"\nMean position error after {', '.join(map(str, AHEAD))} s, m\n\n{table(shown)}")


if __name__ == "__main__":
    main()
