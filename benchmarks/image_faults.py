"""Cameras that break in flight: whole flights through the real Betaflight firmware, and who flies after the fault.

    python benchmarks/image_faults.py [--task avoid] [--vehicle vis_r] [--flights 5] [--json FILE]

The policy flies by rendered images for a second, then its camera breaks; one that hangs upside down does so from the
start, and HOVER must not hand over. Time is virtual: the figures do not depend on the machine.
"""

from common import arguments, table, write
from tests.faults.image_faults import FAULTS, UPSIDE_DOWN, fly_with

from e2efly.simulation.device import compute_at_once, prepare
from e2efly.validation import firmware_program
from e2efly.validation.candidate import candidate
from e2efly.vehicles.loading import load_vehicle


def main() -> None:
    """Fly, print the table, write the figures."""
    args = arguments(__doc__ or "", task="avoid", vehicle="vis_r", flights=5)
    compute_at_once()
    prepare("cpu")
    found, vehicle, built = candidate(args.task, args.vehicle), load_vehicle(args.vehicle), firmware_program.chosen()
    rows, flights = [], {}
    for fault in (*FAULTS, UPSIDE_DOWN):
        ended = [fly_with(built, found, vehicle, fault, seed) for seed in range(args.flights)]
        flights[fault] = [vars(each) for each in ended]
        in_hover = sum(each.mode == "hover" for each in ended)
        rows.append({
            "fault": fault,
            "ended in HOVER": f"{in_hover} of {len(ended)}",
            "from the fault": "never handed over" if fault == UPSIDE_DOWN
            else f"{1e3 * max(each.after_s for each in ended):.0f} ms",
            "from its notice": "" if fault == UPSIDE_DOWN
            else f"{1e3 * max(each.noticed_s for each in ended):.0f} ms",
            "landed by itself": f"{sum(each.landed for each in ended)} of {len(ended)}",
            "reason": ended[0].reason,
        })  # fmt: skip
        print(rows[-1], flush=True)
    print(table(rows))
    write("image_faults", args.json, {"table": rows, "flights": flights})


if __name__ == "__main__":
    main()
