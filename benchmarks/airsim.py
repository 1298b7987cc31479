"""The zoo's policies by state over AirSim's RPC: success beside that in the training's simulator.

    python benchmarks/airsim.py [--tasks hover land track race] [--vehicle vis_r] [--episodes 20] [--address HOST:PORT]
        [--json FILE]

Without an address it starts the tests' server, which speaks AirSim's RPC over MuJoCo's body of the vehicle; with one it
flies the AirSim that runs there. The starts are those of `e2efly eval`.
"""

import time
from contextlib import ExitStack

from common import arguments, table, with_earlier, write

import e2efly
from e2efly.vehicles.loading import load_vehicle


def main() -> None:
    """Fly, print the table, write the figures."""
    from tests.validation.airsim_server import Server, World, settings

    args = arguments(__doc__ or "", vehicle="vis_r", tasks=["hover", "land", "track", "race"], episodes=20, address="")
    rows, differences = [], []
    with ExitStack() as stack:
        address, what = args.address, "an AirSim"
        if not address:
            server = stack.enter_context(Server(World(load_vehicle(args.vehicle), 1, settings())))
            address, what = f"127.0.0.1:{server.port}", "the tests' server over MuJoCo"
        for task in args.tasks:
            began = time.perf_counter()
            found = e2efly.validate(task, f"airsim:{address}", args.episodes, vehicle=args.vehicle)
            differences = list(found.differences)
            for name, each in found.criteria.items():
                rows.append({
                    "criterion": name,
                    "starts": len(each.flights),
                    "in training": f"{100 * each.trained.success.mean():.1f} %",
                    "over AirSim's RPC": f"{100 * each.flown.success.mean():.1f} %",
                    "drop, points": f"{each.drop:+.1f}",
                    "final error, cm": f"{100 * each.trained.final_error.mean():.2f} / "
                    f"{100 * each.flown.final_error.mean():.2f}",
                    "faults": sum(bool(flight.fault) for flight in each.flights),
                })  # fmt: skip
                print(rows[-1], flush=True)
            print(f"{time.perf_counter() - began:.0f} s", flush=True)
    print(table(rows))
    print("\n".join(differences) or "No differences between the vehicles are measured.")
    rows = with_earlier("airsim", args.json, "table", ("criterion",), rows)
    write("airsim", args.json, {"flown": what, "table": rows, "differences": differences})


if __name__ == "__main__":
    main()
