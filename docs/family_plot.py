"""The plot of the vehicles that are drawn from a family."""

from pathlib import Path

import numpy as np

from e2efly.vehicles.family import Family, measured
from e2efly.vehicles.loading import load_vehicle, vehicle_names
from e2efly.vehicles.vehicle import Vehicle
from e2efly.viewing.style import BLUE, CYCLE, figure

DRAWS, SEED = 1500, 0
_SHIPPED = dict(zip(vehicle_names(), (CYCLE[1], CYCLE[2], CYCLE[4]), strict=False))


def plot_family(family: Family, path: str | Path) -> None:
    """Plot vehicles that are drawn from a family, for pairs of parameters, with the shipped vehicles, as a PNG file."""
    drawn = [_shown(vehicle) for vehicle in family.sample(DRAWS, SEED)]
    columns = {name: np.array([each[name] for each in drawn]) for name in drawn[0]}
    shipped = {name: _shown(load_vehicle(name)) for name in _SHIPPED}
    pairs = (
        ("mass (kg)", "arm (cm)"), ("mass (kg)", "roll inertia (kg m²)"), ("mass (kg)", "thrust over weight"),
        ("mass (kg)", "largest roll acceleration (rad/s²)"), ("motor lag (ms)", "rate gain, roll (1/s)"),
        ("rate gain, roll (1/s)", "rate gain, yaw (1/s)"), ("mass (kg)", "drag at 5 m/s over weight"),
        ("mass (kg)", "rotor speed in hover (rad/s)"), ("motor lag (ms)", "delay (ms)"),
    )  # fmt: skip
    notes = [f"{DRAWS} draws; marked: the vehicles that the package ships, of which the sampler knows nothing"]
    with figure(path, f"What the ranges of {family.name!r} draw", 9.0, notes) as fig:
        for ax, (x, y) in zip(fig.subplots(3, 3).flat, pairs, strict=True):
            ax.plot(columns[x], columns[y], ".", color=BLUE, markersize=1.8, alpha=0.5)
            for name, color in _SHIPPED.items():
                at = shipped[name][x], shipped[name][y]
                ax.plot(*at, "o", color=color, markersize=7, markeredgecolor="white", label=name)
            ax.set_xlabel(x)
            ax.set_ylabel(y)
            ax.set_xscale("linear" if x == "motor lag (ms)" else "log")
            ax.set_yscale("linear" if y in ("thrust over weight", "delay (ms)") else "log")
            if y == "drag at 5 m/s over weight":
                ax.set_ylim(1e-3, 1.0)
        fig.axes[0].legend(loc="lower right")


def _shown(vehicle: Vehicle) -> dict[str, float]:
    """The values of a vehicle that the plot shows."""
    v, m = vehicle, measured(vehicle)
    pull = float(v.drag_linear[0] * 5 + v.drag_quadratic[0] * 25)
    low, high = v.thrust_range
    return {
        "mass (kg)": v.mass,
        "arm (cm)": 100 * m["arm"][0],
        "roll inertia (kg m²)": float(v.inertia[0]),
        "thrust over weight": v.thrust_to_weight,
        "largest roll acceleration (rad/s²)": 2
        * (high - low)
        * abs(float(v.rotor_position[0, 1]))
        / float(v.inertia[0]),
        "motor lag (ms)": 1e3 * v.motor_time_constant,
        "rate gain, roll (1/s)": float(v.rate_gain[0]),
        "rate gain, yaw (1/s)": float(v.rate_gain[2]),
        "drag at 5 m/s over weight": pull / (v.mass * 9.81),
        "rotor speed in hover (rad/s)": v.hover_rotor_speed,
        "delay (ms)": 1e3 * v.latency,
    }
