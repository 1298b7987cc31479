"""Identification from logs of real flights, which are not part of this repository.

    python benchmarks/real_logs.py --logs FOLDER [--vehicle crazyflie]

FOLDER holds `arplab/log10` and `arplab/log15` (Crazyflie 2.x, 1 kHz, of data-driven-system-identification by the
arplaboratory) and `nanobench/*.csv` (Crazyflie 2.1, 100 Hz with motion capture, of nanobench-iros2026 by syediu).

The first are fitted together, every fifth window kept out. Of the second, every flight is foretold by the fit of those
that follow other trajectories: with its measured attitude, from its measured position and velocity, by thrust from
the motors' voltage and by drag; then once more with tilt and thrust scale from its first 10 s.
"""

from pathlib import Path
from typing import Any

import numpy as np
from common import arguments, table, write

from e2efly.alignment.checks import checked
from e2efly.alignment.found import Found
from e2efly.alignment.identification import identify, typical_volts
from e2efly.alignment.open_loop import HOLD, HOVER, OWN_S, OWN_VEHICLE, VEHICLE, forecast, typical
from e2efly.alignment.prediction import judged
from e2efly.alignment.vehicle_file import merged
from e2efly.alignment.windows import STEP
from e2efly.logs.csv_file import column_map
from e2efly.logs.readers import LogReading, read_part
from e2efly.logs.recording import Record
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
TUNED = ("circle", "figure8", "helix")
"""The trajectories by which the prediction was tuned."""


def crazyflie(folder: Path, vehicle: Vehicle) -> list[dict[str, Any]]:
    """Lag, thrust, inertia and rates of the logs at 1 kHz."""
    records = checked([record for part in PARTS for record in read_part(folder / part)], vehicle)
    found = identify(vehicle, records)
    names = [u.name for u in found.model.unknowns]
    new = merged(vehicle, {e.name: e for e in found.estimates})
    sigma = dict(zip(names, found.sigma, strict=True))
    plain = found.structures.get("without delay", np.full(len(names), np.nan))[names.index("motor_time_constant")]
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
        *(row("refused", str(refusal)) for refusal in found.refusals),
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
    volts = typical_volts(records)
    fits: dict[str, tuple[Found, list[float]]] = {}
    rows = []
    for record in records:
        kind = _trajectory(record)
        if kind not in fits:
            others = [r for r in records if _trajectory(r) != kind]
            fits[kind] = identify(vehicle, others, volts=volts), [r.duration for r in others]
        found, durations = fits[kind]
        q = typical(found.fit.q, durations, record.duration)
        seen = forecast(found.model, found.p, q, record, volts, AHEAD)
        whole, rest = (seen.mean(after)["position"] for after in (0.0, OWN_S))
        told = {name: whole[name].tolist() for name in (HOLD, HOVER, VEHICLE)} | {
            OWN_VEHICLE: rest[OWN_VEHICLE].tolist()
        }
        rows.append({"flight": record.path.stem, **told})
        print(rows[-1], seen.own, flush=True)
    tuned = [row["flight"].split("_")[1] in TUNED for row in rows]
    parts = {"mean of those tuned on": tuned, "mean of the others": [not x for x in tuned], "mean": [True] * len(rows)}
    for label, kept in list(parts.items()):
        some = [row for row, taken in zip(rows, kept, strict=False) if taken]
        rows.append(
            {"flight": label} | {k: np.mean([r[k] for r in some], 0).tolist() for k in some[0] if k != "flight"}
        )

    def said(x: Any) -> Any:
        return " / ".join(f"{v:.3f}" for v in x) if isinstance(x, list) else x

    print("refused:", refused)
    return rows, [{k: said(x) for k, x in row.items()} for row in rows]


def _trajectory(record: Record) -> str:
    return record.path.stem.split("_")[1]


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
