"""The zoo's policies that see, on plants that render: success beside that in the training's simulator.

    python benchmarks/plants_by_sight.py [--plants mujoco betaflight] [--tasks land_visual avoid race_clutter]
        [--vehicle vis_r] [--json FILE]

The starts and worlds are those of `e2efly eval`: 200 of each criterion in MuJoCo, 20 through the real firmware.
"""

import time

from common import arguments, table, write

import e2efly


def main() -> None:
    """Fly, print the table, write the figures."""
    args = arguments(
        __doc__ or "", vehicle="vis_r", plants=["mujoco", "betaflight"], tasks=["land_visual", "avoid", "race_clutter"]
    )
    rows, reports = [], {}
    for task in args.tasks:
        for plant in args.plants:
            began = time.perf_counter()
            found = e2efly.validate(task, plant, vehicle=args.vehicle)
            took = time.perf_counter() - began
            reports[f"{task} on {plant}"] = {name: float(c.drop) for name, c in found.criteria.items()}
            for name, each in found.criteria.items():
                rows.append({
                    "criterion": name,
                    "plant": plant,
                    "starts": len(each.flights),
                    "in training": f"{100 * each.trained.success.mean():.1f} %",
                    "on the plant": f"{100 * each.flown.success.mean():.1f} %",
                    "drop, points": f"{each.drop:+.1f}",
                    "faults": sum(bool(flight.fault) for flight in each.flights),
                })  # fmt: skip
                print(rows[-1], flush=True)
            print(f"{took:.0f} s", flush=True)
    print(table(rows))
    write("plants_by_sight", args.json, {"table": rows, "drops": reports})


if __name__ == "__main__":
    main()
