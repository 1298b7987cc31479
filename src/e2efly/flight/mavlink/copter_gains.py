"""ArduCopter's parameters with which its rate loop and mixer answer as a vehicle file says.

A motor output u turns a rotor at idle + u (full - idle), and ArduCopter's thrust is (1 - f) u + f u^2 of the range, f
being MOT_THST_EXPO. Its mixer gives half of a torque output of 1 to each rotor: the body accelerates by
A = range/2 sum |arm| / J, and P = K / A with the file's K = `rate_gain`. The gyro's low-pass and the loop delay the
rate by T, which takes K T of damping. D gives it back: D = P T.
"""

from collections.abc import Mapping

import numpy as np

from e2efly.flight.row import Row
from e2efly.vehicles.vehicle import Vehicle, allocation_matrix

GYRO_FILTER_HZ = 80
"""Low-pass of the gyro, as ArduPilot's tuning guide has it for small propellers, Hz."""
DELAY_S = 0.004
"""T, s."""
INTEGRAL = 0.05
"""I / P, in units of K, for a file without `rate_integral_gain`."""
AXES = ("RLL", "PIT", "YAW")
GROUPS = (
    *((tuple(f"ATC_RAT_{axis}_{term}" for term in "PID"), 1) for axis in AXES),
    *((tuple(f"ATC_RAT_{axis}_FLT{which}" for which in "TED"), 2) for axis in AXES),
    *(((name,), 1) for name in ("INS_GYRO_FILTER", "MOT_THST_EXPO", "MOT_SPIN_MIN", "MOT_SPIN_MAX")),
)
"""The parameters that stand in one row of the table, and how many of them, the first ones, are judged."""
NAMES = tuple(name for names, _ in GROUPS for name in names)
"""The names of all of them."""
ALIKE = 1.25
"""A parameter is as the vehicle file says if it is within this factor of it."""


def copter_gains(vehicle: Vehicle) -> dict[str, float]:
    """The parameters by name."""
    k2, k1, _ = (float(k) for k in vehicle.thrust_map)
    low, full = float(vehicle.rotor_speed_min), vehicle.full_rotor_speed
    span = k2 * (full**2 - low**2) + k1 * (full - low)
    authority = span / 2 * np.abs(allocation_matrix(vehicle)[1:]).sum(1) / vehicle.inertia
    gain, integral = vehicle.rate_gain, vehicle.rate_integral_gain
    slow = max(DELAY_S - (vehicle.gyro_time_constant or 0.0), 0.0)
    rows = np.stack([gain, INTEGRAL * gain**2 if integral is None else integral, gain * slow], axis=1)
    terms = {
        f"ATC_RAT_{axis}_{term}": float(value)
        for axis, row in zip(AXES, rows / authority[:, None], strict=True)
        for term, value in zip("PID", row, strict=True)
    }
    filters = {
        f"ATC_RAT_{axis}_FLT{which}": hz
        for axis in AXES
        for which, hz in (("T", 0.0), ("E", 0.0), ("D", GYRO_FILTER_HZ / 2))
    }
    return terms | filters | {
        "INS_GYRO_FILTER": float(GYRO_FILTER_HZ), "MOT_THST_EXPO": k2 * (full - low) ** 2 / span,
        "MOT_SPIN_MIN": low / full, "MOT_SPIN_MAX": 1.0,
    }  # fmt: skip


def gain_rows(vehicle: Vehicle, told: Mapping[str, float]) -> tuple[Row, ...]:
    """The parameters beside the vehicle file's, as rows of the table. The file may be wrong about a real vehicle, so
    none of them forbids a flight.
    """
    wanted = copter_gains(vehicle)
    return tuple(
        Row(
            ", ".join(names), _joined(told, names), f"about {_joined(wanted, names)}, by the vehicle file", True,
            tuple(f"param set {name} {wanted[name]:.3g}" for name in names),
            told=all(name in told and _alike(told[name], wanted[name]) for name in names[:judged]),
        )
        for names, judged in GROUPS
    )  # fmt: skip


def _joined(values: Mapping[str, float], names: tuple[str, ...]) -> str:
    return ", ".join(f"{values[name]:.3g}" if name in values else "not told" for name in names)


def _alike(value: float, wanted: float) -> bool:
    return value == wanted if wanted == 0 else wanted / ALIKE <= value <= wanted * ALIKE
