"""Steps of body rate and thrust flown through the real firmware, and the simulator's, before and after alignment.

    python benchmarks/step_response.py [--vehicle vis_r] [--log steps.csv]

The paper's figure of the step-response alignment, with the firmware in the place of the vehicle: it flies over the
rigid body of the vehicle's file, with a quicker tune than the file says (`tests.validation.steps`),
`e2efly.alignment.alignment` fits delay and rate loop to the log, and docs/step_response.png shows the mean of four
steps of each command. `--log` keeps the flight as CSV.
The paper's figure of the policy's response after it is docs/closed_loop.png: `e2efly fly steps` and the alignment with
its log, then the zoo's race through the same firmware and, from the same start, in the simulator.
"""

import dataclasses
import json
import tempfile
from pathlib import Path
from time import monotonic
from typing import Any

import numpy as np
from common import arguments, table, write
from PIL import Image
from tests.validation.firmware_excitation import fly_excited
from tests.validation.steps import HOLD_S, QUICKER, SetpointStep, fly_steps

from e2efly.alignment.alignment import LEAD_S, Alignment, align
from e2efly.alignment.checks import checked
from e2efly.alignment.replay import SIGNALS, stretches
from e2efly.alignment.vehicle_file import merged
from e2efly.commands.align import pose_delay_of
from e2efly.flight.excitation import StepsOptions
from e2efly.logs.csv_file import write_csv
from e2efly.logs.flight_log import read_log
from e2efly.logs.readers import read_flights
from e2efly.logs.recording import Record
from e2efly.logs.telemetry import Telemetry
from e2efly.policy.loader import load_policy
from e2efly.policy.zoo import policy_file
from e2efly.simulation.device import prepare
from e2efly.tasks.route import usual_route
from e2efly.validation import firmware_program
from e2efly.validation.bridge_session import rehearsal_settings
from e2efly.validation.closed_loop import SIGNALS as COMPARED
from e2efly.validation.closed_loop import closed_loop, policy_of
from e2efly.validation.rehearsal import LINK_S, rehearse
from e2efly.validation.rig import Rig
from e2efly.vehicles.loading import load_vehicle
from e2efly.vehicles.vehicle import Vehicle
from e2efly.viewing.alignment_plots import AFTER, ASKED, BEFORE, MEASURED, both
from e2efly.viewing.closed_loop_plot import plot_closed_loop
from e2efly.viewing.style import figure

PICTURE = Path(__file__).parents[1] / "docs" / "step_response.png"
LOOP = PICTURE.with_name("closed_loop.png")
NAMES = ("thrust", "roll rate", "pitch rate", "yaw rate")
RISEN = 0.632
"""1 - 1/e."""
COLUMNS = ("firmware", "simulator, before", "simulator, aligned")


def responses(
    record: Record, steps: list[SetpointStep], found: Alignment, channel: int
) -> tuple[np.ndarray, list[np.ndarray]]:
    """Times since a step, s, and the mean response as a share of the step: firmware, simulator before and after."""
    own = [step for step in steps if step.channel == channel]
    flown = stretches(record, [step.time - LEAD_S for step in own], LEAD_S + HOLD_S)
    size = np.array([step.size for step in own])[:, None]
    stream, axis = ("body_rate", channel - 1) if channel else ("specific_force", 2)
    shares, calm = [], flown.time < LEAD_S
    for seen in (flown.measured, *both(found, flown)):
        value = seen[stream][..., axis]
        shares.append(np.mean((value - value[:, calm].mean(1, keepdims=True)) / size, axis=0))
    return flown.time - LEAD_S, shares


def reached(time: np.ndarray, share: np.ndarray, level: float) -> float:
    """When a response passes a level on its way to 63 %, s."""
    i = int(np.argmax((share >= RISEN) & (time > 0)))
    i = int(np.flatnonzero(share[: i + 1] < level)[-1]) + 1
    return float(np.interp(level, share[i - 1 : i + 1], time[i - 1 : i + 1]))


def race(name: str) -> dict[str, Any]:
    """VIS-R's file, aligned by `e2efly fly steps` through the firmware; then the zoo's race through the same firmware,
    and the simulator's race by the same policy from the same start, with the file and with the aligned vehicle.
    """
    vehicle, file = load_vehicle(name), policy_file("race", name)
    policy, firmware = load_policy(file), firmware_program.chosen()
    usual = usual_route(policy.contract)
    route = dataclasses.replace(usual, outside=True, **usual.whole)
    with tempfile.TemporaryDirectory() as folder:
        steps, path = Path(folder) / "steps.mcap", Path(folder) / "race.mcap"
        with Telemetry(steps) as log:
            fly_excited(firmware, vehicle, vehicle, rehearsal_settings(1.5), options=StepsOptions(), log=log)
        records = checked(read_flights(steps), vehicle)
        found = align(vehicle, records, pose_delay_of(None, records)[0])
        aligned = merged(vehicle, {e.name: e for e in found.estimates})
        with Telemetry(path, queue_size=200_000) as log:
            flown = rehearse(firmware, policy, vehicle, log=log, route=route)
            settings = json.dumps({"policy": str(file), "goal": vars(route)}, default=str)
            log.record("meta", monotonic(), {"contract": policy.contract.to_json(), "settings": settings})
        (record,), told = checked(read_flights(path), vehicle), read_log(path)
        flew = policy_of(told)
        assert flew is not None
        vehicles = {"before": vehicle, "aligned": aligned}
        loop = closed_loop(told, record, *flew, vehicles, pose_delay_of(None, [record])[0])
    plot_closed_loop(LOOP, loop)
    return {
        "complete": flown.complete, "steps": report(vehicle, found),
        "closed_loop": {
            "compared_s": loop.compared,
            "rms_difference": {
                stream: {"unit": unit, **{which: loop.difference(which, stream) for which in loop.simulated}}
                for stream, unit in COMPARED.items()
            },
        },
    }  # fmt: skip


def report(vehicle: Vehicle, found: Alignment) -> dict[str, Any]:
    """What an alignment found."""
    gains = next(e for e in found.estimates if e.name == "rate_gain")
    told = found.response
    return {
        "pose_delay_s": found.pose_delay,
        "delay_s": dict(zip(("before", "aligned", "sigma"), found.delay, strict=True)),
        "rate_gain": {
            "before": vehicle.rate_gain.tolist(), "aligned": gains.value.tolist(), "sigma": gains.sigma.tolist(),
        },
        "thrust_over_simulated": found.thrust,
        "motor_lag_s": None if told is None else {
            "before": vehicle.motor_time_constant, "aligned": told.lag[0], "sigma": told.lag[1], "refused": told.reason,
        },
        "held_out_rms": {
            name: {"unit": SIGNALS[name], "before": found.before[name], "aligned": found.after[name]}
            for name in found.before
        },
    }  # fmt: skip


def main() -> None:
    """Fly, align, draw, write JSON."""
    options = arguments(__doc__ or "", vehicle="vis_r", log="")
    prepare("cpu")
    vehicle = load_vehicle(options.vehicle)
    built = firmware_program.chosen()
    with tempfile.TemporaryDirectory() as folder, Rig(built, Path(folder), vehicle, settings=QUICKER) as rig:
        record, steps = fly_steps(rig)
    if options.log:
        write_csv(record, Path(options.log))
    (record,) = checked([record], vehicle)
    found = align(vehicle, [record], vehicle.latency - LINK_S)
    rows: list[dict[str, Any]] = []
    curves = {channel: responses(record, steps, found, channel) for channel in (1, 2, 3, 0)}
    for channel, (time, shares) in curves.items():
        rows.append({"response": NAMES[channel]})
        for column, share in zip(COLUMNS, shares, strict=True):
            times = " / ".join(f"{1e3 * reached(time, share, level):.0f}" for level in (0.1, RISEN))
            rows[-1][column] = f"{times} ms" + (f", {100 * max(share.max() - 1, 0):.0f} %" if channel else "")
    draw(curves)
    content = {"table": rows, "steps": report(vehicle, found), "race": race(options.vehicle)}
    write("step_response", options.json, content)
    print(table(rows))
    print({k: v for k, v in content.items() if k != "table"})


def draw(curves: dict[int, tuple[np.ndarray, list[np.ndarray]]]) -> None:
    """The picture: commanded, the firmware's response, the simulator's before and after."""
    notes = ["VIS-R; mean of four steps (3 rad/s, yaw 2 rad/s, thrust 4 m/s², and 0.6 of it, both ways), over the step"]
    asked: dict[str, Any] = ASKED | {"drawstyle": "default"}
    measured: dict[str, Any] = MEASURED | {"label": "firmware"}
    with figure(PICTURE, "Steps through real Betaflight firmware, and the simulator", 5.6, notes) as fig:
        for place, (channel, (time, shares)) in enumerate(curves.items(), 1):
            ax = fig.add_subplot(2, 2, place)
            ax.plot([1e3 * time[0], 0, 0, 1e3 * time[-1]], [0, 0, 1, 1], **asked)
            for share, style in zip(shares, (measured, BEFORE, AFTER), strict=True):
                ax.plot(1e3 * time, share, **style)
            ax.set_title(NAMES[channel])
            ax.set_ylabel("response over command (1)")
            ax.set_xlim(-50, 1e3 * HOLD_S)
            ax.set_ylim(-0.1, 1.35)
            if place > 2:
                ax.set_xlabel("time since the step was sent (ms)")
        handles, labels = fig.axes[0].get_legend_handles_labels()
        fig.legend(handles, labels, loc="outside lower center", ncols=len(labels))
    with Image.open(PICTURE) as picture:
        small = picture.convert("RGB").quantize(256, dither=Image.Dither.NONE)
    small.save(PICTURE, optimize=True)


if __name__ == "__main__":
    main()
