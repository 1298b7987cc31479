"""Make the pictures of the README and the tables of docs/benchmarks.md from benchmarks/results: `make docs`."""

import json
import shutil
import subprocess
import sys
import tempfile
import textwrap
from functools import cache
from pathlib import Path
from typing import Any

from e2efly.commands.terminal import markdown
from e2efly.commands.train import recorded
from e2efly.config import EnvConfig
from e2efly.runs.inputs import fingerprint

DOCS = Path(__file__).parent
RESULTS = DOCS.parent / "benchmarks" / "results"
BEGIN, END = "<!-- figures: written by `make docs` -->", "<!-- end of the figures -->"
EARLIER, EMBREE = "earlier", "of Embree's"
NOT_TODAY = f" What is marked *{EARLIER}* was measured with another configuration or integrator than today's."
GOALS = {
    "hover, 99%": "hover",
    "land, 99%": "land",
    "track, 99%": "track",
    "race, 95%": "race, 95 %",
    "thrown, 99%": "hover, thrown in any attitude",
    "land_visual, 99%": "land on a pad that is only seen",
}
"""Rows of the table of README.md."""
TITLES = {
    "rates": "Rates",
    "many_vehicles": "Vehicles that share a world, beside vehicles alone",
    "rate_loop": "What a held rate loop costs",
    "mesh_rendering": "Rendering of mesh scenes",
    "rendering": "Images of the clutter scene: ground, 4 gates, 16 obstacles, another world for each camera",
    "visual_tasks": "Tasks flown by sight: trained, then flown under stress from unseen starts in unseen worlds",
    "expert": "The expert of avoid, flown as a pilot",
    "time_to_criterion": "Time to the criterion, from process start",
    "cold_start": "Where a training spends its time, seconds from the start of the process to its end",
    "thrown": "Catching a thrown vehicle: success over 1000 unseen starts, full presets",
    "thrown_starts": "Thrown starts that nothing saves",
    "stable_baselines3_ppo": "Time to the hover criterion, Stable-Baselines3 on the same environment, at most 200 s",
    "any_track": "One policy for any track",
    "race_speed": "Racing at a commanded speed",
    "success": "Success over 1000 unseen starts, full presets",
    "ablation": "The reward ablation, from process start, empty cache",
    "robust": "The preset robust: seconds from process start, cold, and success under stress",
    "multirotor": "One policy for frames of 4 to 8 rotors, tilted and lopsided: 1000 unseen ones, by rotors",
    "any_vehicle": "One policy for any quadrotor: 1000 unseen vehicles, by delay, and the vehicles that ship",
    "raptor": "One policy for any quadrotor, beside RAPTOR: 1000 unseen vehicles, by delay",
    "zoo_stress": "The zoo under stress: vehicles, air and sensors that are not those of the training",
    "zoo_stress_gap_hover_aware": "Gap and hover with a target in view, under the same stress",
    "zoo_stress_by_sight": "The zoo's policies that see, under stress of the vehicle and of its cameras",
    "identify": "Identification of hidden vehicles from the logs of a flight",
    "identify_structure": "Identification of hidden vehicles whose structure no vehicle file tells",
    "identify_structure_plain": "The same, fitted by a model without that structure",
    "tune": "From the log of a flight to a policy: hidden vehicles far from their file",
    "eyes": "Races by a camera and an IMU alone",
    "race_eyes": "The same end to end",
    "step_response": "Steps of the real firmware, and the simulator's before and after alignment",
    "step_alignment": "Alignment of hidden vehicles by a flight of steps",
    "identify_betaflight": "Identification of hidden vehicles behind the real firmware",
    "sim_to_sim": "The same policies in MuJoCo, 200 starts",
    "airsim": "The same policies over AirSim's RPC, 20 starts",
    "mavlink": "Whole flights over MAVLink, PX4 and ArduCopter as they document themselves",
    "arducopter": "Whole flights through the real ArduCopter over MAVLink, nobody helping",
    "crazyflie": "Whole flights over CRTP, a Crazyflie as its firmware's sources say",
    "firmware_flights": "Whole flights through real Betaflight firmware, nobody helping",
    "firmware_vehicles": "Every vehicle's policies through real Betaflight firmware",
    "room_flights": "The paper's six tasks through real Betaflight firmware, in a room of 6x6 m",
    "controllers": "Hover controllers, and where learning pays",
    "filter": "The filter of `fly --guard filter`: flights against it, and what it costs",
    "plants_by_sight": "Policies that see, on plants that render",
    "image_faults": "Cameras that break in flight",
    "hil_rehearsal": "Hardware in the loop, rehearsed in real time",
    "hil_room": "Hardware in the loop, rehearsed in a room of 6x6 m",
    "pad_masks": "Masks by the package's network, of rendered pads that it never saw",
    "gate_masks": "Gates found by a network in rendered colours that it never saw",
    "firmware_faults": "Faults injected into flights of the real firmware",
    "fault_campaign": "Pairs and triples of faults by chance, injected into flights of the real firmware",
    "process_faults": "The bridge's process killed, stopped, its disk full, in flight",
    "watch": "The viewer",
    "bridge_loop": "The bridge's control loop, flying the firmware in real time",
    "runtime_speed": "The runtime on a companion computer",
    "onboard": "The part that flies, beside the whole",
    "c_export": "The zoo's policies as C",
    "msp_fuzz": "MSP codec under fuzzing",
    "log_fuzz": "Readers of flight logs under fuzzing",
}

ZOO, NONE = "the zoo's policies", "none"
POLICIES = {
    **dict.fromkeys(
        (
            "zoo_stress_gap_hover_aware", "zoo_stress_by_sight", "any_vehicle", "airsim", "firmware_flights",
            "multirotor", "eyes", "race_eyes",
            "firmware_vehicles", "room_flights", "controllers", "filter", "plants_by_sight", "image_faults",
            "hil_rehearsal", "hil_room", "fault_campaign", "onboard", "c_export", "race_speed",
        ),
        ZOO,
    ),
    **dict.fromkeys(
        (
            "many_vehicles", "rate_loop", "mesh_rendering", "rendering", "expert", "thrown_starts", "identify",
            "step_response",
            "identify_structure", "identify_structure_plain", "mavlink", "arducopter", "crazyflie", "step_alignment",
            "pad_masks", "gate_masks",
            "identify_betaflight", "runtime_speed", "msp_fuzz",
            "log_fuzz",
        ),
        NONE,
    ),
    **dict.fromkeys(("success", "ablation", "stable_baselines3_ppo", "sim_to_sim", "visual_tasks"), "preset nominal"),
    **dict.fromkeys(
        ("cold_start", "robust", "firmware_faults", "process_faults", "watch", "bridge_loop"), "preset robust"
    ),
    "rates": "preset nominal", "time_to_criterion": "presets nominal and thrown", "thrown": "preset thrown",
    "any_track": "preset any_track", "raptor": f"preset raptor and {ZOO}", "tune": "preset identified",
    "zoo_stress": f"{ZOO}, and preset nominal",
}  # fmt: skip
"""The policies of each table: presets by which they were trained, the zoo's, or none."""
SCRIPTS = {
    "identify_betaflight": "identify.py --plant betaflight",
    "identify_structure": "identify.py --plant structure --bare --first 1110 --vehicles 20",
    "identify_structure_plain": "identify.py --plant structure --plain --first 1150",
    "hil_rehearsal": "hil_rehearsal.py --vehicle vis_h",
    "hil_room": "hil_rehearsal.py --room", "gate_masks": "gate_masks.py --file gates.onnx",
    "zoo_stress_by_sight": "zoo_stress.py --by-sight", "room_flights": "firmware_flights.py --room",
}  # fmt: skip
"""What measured a file of results that has not the name of its script."""
FIRST = """
Each table names its policies: the presets by which they were trained, or the zoo's. Where a configuration stands, it
is the fingerprint of everything that defines the training, and the command that it belongs to stands in the file. What
is marked as earlier was measured with another configuration than that of today. The rates and times below that are
older than 2026-11-24 were measured with the first-order integrator, which was the default until then. Today's default
takes three times as long per physics sub-step ([physics](physics.md)).

All of these are figures of a CPU. Those of a GPU: [On a GPU](gpu.md)."""
"""What stands over all tables."""
NOTES = {
    "c_export": """
Plain: `cc -O2`. Native: `cc -O3 -march=native`. Difference: the largest difference of an action from the
value of the policy.onnx in double precision, on 200 random inputs; for ONNX Runtime likewise.
[What is exported](onboard.md#as-c).""",
    "race_speed": """
Two laps, one of an open track, with the vehicle of the file in still air; of *any quadrotor*, with random vehicles in
still air. Random vehicles are those of the policy's training, in its winds and gusts. Speeds are along the way from the
first gate on: the mean of the races that succeed, and the highest of all. The distance to the wall is the smallest of
any race's path, of the centre of mass. The starts have a seed by which no recipe and no policy was chosen (6000000).
[What is flown](tasks.md#at-a-commanded-speed).""",
    "onboard": """
Each flies hover with a controller that gives the answers of recorded firmware. [How to install
it](onboard.md).""",
    "rates": """
Environment steps have seven sub-steps, and include everything. Training is that of the whole preset, networks and
evaluations apart.""",
    "rate_loop": """
Distance between the positions of the training's physics and of an independent plant in float64, after 2 s of violent
`ctbr` commands, by the rate loop of the plant. [What it means](physics.md).""",
    "any_track": """
A specialist begins with the weights of the one policy and learns on one track alone for 2.5 million
steps. Eight specialists were trained, not fifty. The goals that were missed and what was tried:
[any track](any-track.md#how-well-it-flies).""",
    "cold_start": """
Cold: with an empty compilation cache. Later: the same command again.

![a bar for each command, in parts](cold_start.png)""",
    "visual_tasks": """
The policies are by the presets `nominal` of that day, in race_clutter one policy for each track.
Today's presets are `robust`, and race_clutter has one policy for all tracks: [the zoo by
sight](#the-zoos-policies-that-see-under-stress-of-the-vehicle-and-of-its-cameras).""",
    "expert": """
It knows every trunk, and the mass, thrust, centre of mass, delay, motors and rate loop of its vehicle, but not its
inertia or the wind. Policies that imitate it have to see the trunks.""",
    "raptor": """
Success: within 0.1 m for the last second of 8 s. The rows are explained in
[any quadrotor](any-vehicle.md).""",
    "identify": """
Each log has 30 s in MuJoCo, with noise, biases, gaps, late poses and sag. Errors are absolute values;
those of inertia are per axis. The structural part of sigma (`STRUCTURE`) was set on other vehicles than
these. It makes the intervals of thrust, lag, delay and roll and pitch inertia wider than MuJoCo needs,
because real firmware and real logs differ more from the model. [How it is done](identification.md).""",
    "identify_structure": """
20 bodies that were not used for tuning. Each of these has a probability of one half: lag up and down apart, an integral
part, a filter and a feed-forward in the rate loop, arms up to 7 % longer or shorter, a centre of mass up to 5 mm off,
rotors up to 4 % apart, products of inertia, rotor drag, sag, wind, gusts. MuJoCo flies them behind a rate loop and a
mixer of the benchmark's own. Each log is identified three times: whole, from motor outputs in place of commands and
rotor speeds, and from commands alone. [How it is done](identification.md).""",
    "identify_structure_plain": """
Another hundred bodies, whole logs. The fit of the first table's model alone: what it reports of such a body must be
right within three standard deviations, or the alarm rings. What is far off is refused by name, so that not all
parameters are identified. [How it is done](identification.md).""",
    "mavlink": """
Autopilots that we wrote from the documentation of PX4 and ArduCopter, over our rigid body, in virtual time. No firmware
flies here. The file has the twenty faults, too. [PX4 and ArduCopter](mavlink.md).""",
    "arducopter": """
ArduPilot's own SITL program, which a user brings, over our rigid body behind its JSON interface, in virtual time. The
file has the faults and the rows of `fly --check`, too. [The real ArduCopter](mavlink.md#the-real-arducopter).""",
    "eyes": """
No motion capture: the pose source `gates:` tells the vehicle where it is. Of each flight are drawn a camera mounted 2
degrees askew, images 20 to 60 ms old, a rolling shutter, lost images, gates that stand 2 cm from the map, and an IMU
with noise and biases. Tracks on MuJoCo; then rows that the estimator was not made for (its own size of four_gates), and
the stress test; last, whole flights through the real firmware. [How it is done](eyes.md).""",
    "race_eyes": """
One network, told neither where it is nor how fast it flies: the zoo's `race_eyes`. Each track, one lap: with the
vehicle of the file, with vehicles, air and cameras as its training draws them, on MuJoCo, and on the plant of the real
firmware. Then rows of the stress test. Last, whole flights of three laps through the real firmware.
[How it is done](eyes.md#end-to-end).""",
    "gate_masks": """
Whole pictures of 640 x 360 pixels, gates among poles, beams, blocks and walls. Of the looks kept apart, neither
textures nor sun, bars, panels and seeds are those of the training. A gate can be seen if two corners of its opening
can, and is found if two of them are, within 10 pixels. The median error counts what is not found as infinite.
[Racing from colours](eyes.md#from-colours).""",
    "step_response": """
VIS-R; mean of four steps of each command. The table has the time until 10 % and 63 % of the step, and
the overshoot. No overshoot is given for thrust, because an accelerometer shakes its measurement.
[How it is done, and the picture](identification.md#align).""",
    "step_alignment": """
Vehicles as in the tables of the identification, flown for 39 s by `e2efly fly steps`, on seeds that were not
used for tuning. In MuJoCo, truth is exact. Behind the firmware, it is the rig's own clock for the delay (poses'
age and time from a command to the setpoint) and the body's motor lag; only the bridge's own log is used.
[How it is done](identification.md#steps).""",
    "tune": """
VIS-R's file. The body has up to 25 % more mass, up to 20 % less thrust, inertia up to x1.5, motor lag up
to x1.6, up to 30 ms more delay and drag up to x2, and at least half of each of these changes. The policies'
columns have the success of 100 flights in MuJoCo on the hidden body, and the median time of a success. The
stress is flown about the identified vehicle, 250 starts a row. The seconds are those of one body, and
other programs ran at the same time. [How it is done](identification.md#from-a-log-to-a-policy).""",
    "plants_by_sight": """
The starts and worlds are those of `e2efly eval`. Images are rendered at the plant's true pose.""",
    "image_faults": """
The policy of avoid flies by rendered images for a second before its camera breaks. *From its notice*: from
the first control step in which the images are no longer good. A late or silent camera is noticed when its
newest image is older than the oldest image of the training, plus the time of one image, plus 50 ms.""",
    "hil_rehearsal": """
The zoo's race_clutter of VIS-H, commanded to fly at 4 to 6 m/s, with a radio of 57 ms between the bridge and
the vehicle. Motion capture, HIL node, bridge with watchdog, radio and firmware are processes in real time on
two cores. Times are the median / 99 % of the worst lap. In the second table each process is killed once
in flight. [How the rehearsal works](hil.md#rehearse-it-first).""",
    "hil_room": """
As above, for VIS-R in [a small room](hil.md#a-small-room). The fence is that of the room in which [whole
flights](#the-papers-six-tasks-through-real-betaflight-firmware-in-a-room-of-6x6-m) are flown.""",
    "identify_betaflight": """
Each log has 30 s of `e2efly fly excitation`, in a fence of 12 x 12 x 4.8 m, flown by the bridge through
Betaflight 4.6 in virtual time. The true delay is measured by the rig's own clock: the age of the poses, and
the time from a command to the setpoint. Thrust is a quadratic function of the motor outputs. A log with
fewer than 200 motor outputs a second gives thrust, lag and drag, but no inertia.
[What to fly](identification.md#what-to-fly).""",
    "robust": """
Five seeds, 1000 starts per row. While the last two seeds of track and the first three of race trained,
other programs ran on the same two cores: these seeds took up to twice the time of the others.""",
    "zoo_stress": """
Percent of 250 unseen starts that succeed, by the worst criterion, in the training simulator. The rows
are explained in [robustness](robustness.md#stress). "preset nominal" has no memory and was trained on the
nominal vehicle (seed 0).""",
    "zoo_stress_gap_hover_aware": """
As above. A Crazyflie of 27 g does not stay within 10 cm of its target in such gusts and wind.""",
    "zoo_stress_by_sight": """
Percent of 250 unseen starts that succeed, by the worst criterion: land_visual has one, avoid three
speeds, race_clutter three tracks. The rows are explained in [robustness](robustness.md#stress). Three
seeds of avoid on the nominal vehicle, with 1000 unseen forests each, succeed at 5 / 8 / 10 m/s in
99.7 / 99.3 / 98.7, 99.8 / 98.9 / 97.7 and 99.4 / 98.8 / 98.4 %. They fly the 40 m from a standing start
in 9.1, 7.5 and 7.7 s, which is 87, 67 and 52 % of the commanded speed. The first seed was trained in
273 s.""",
    "room_flights": """
The fence is 5.6 x 5.6 x 2.7 m, 0.2 m before the walls; it would end a policy's flight before the vehicle
leaves it. *Flown space*: the box of all true positions of the five flights, from take-off to landing. The races
fly three laps of `room_6`, and the fastest is told the highest of 8, 7, 6, 5 and 4 m/s at which all five
flights succeed. The others fly what `e2efly fly` flies without further options.""",
    "multirotor": """
A success is within 0.1 m for the last second of 8 s. *Straightened*: the frames of the family. *As drawn*: those that
its law draws before it straightens what does not hover by the thrusts of smallest norm. *Feasible*: what a linear
programme calls so: it hovers level, with a tenth of weight times arm of roll and pitch torque to spare, and a tenth of
weight times torque ratio of yaw torque.""",
    "firmware_vehicles": """
Five to ten whole flights each: take-off, the task, landing, nobody helping. *Starts*: success in 20 of `e2efly validate
--plant betaflight`, in the simulator and behind the firmware. The firmware has the gains that each vehicle's file asks
for. The last column names what gave a flight another mode than its mission.""",
    "firmware_flights": """
The zoo's policies of VIS-R, as they ship, in all nine tasks. Success is the task's own verdict,
by the code that judges training. All policies are by the preset `robust`. What the last three see is
rendered at the body's true pose, in another world each time. A flight that touches a solid does not
succeed. The race is half a metre higher than its track. The fence's guard ended the third
flight of race_clutter near the ground.""",
    "filter": """
VIS-R on the simulator's body. Each flight has a fence of its own with a largest speed of its own, 3 to 10
m/s. There are 90 ms of delay, noise of motion capture, gusts of up to 3 m/s, and a fifth less thrust, of
which the filter is not told. In the second half of the table that fifth is lost suddenly at one moment of
the flight, which is faster than a battery sags. The margins were set on other flights of these kinds. A
breach is any moment outside the fence, or above its speed or tilt. The tables after the first one have:

1. the steps of the zoo's own flights in which the filter would change the command, in fences around all of
   them with 1 m/s and 0.4 rad to spare;
2. the share of the default fence in which the vehicle may fly level at a speed in every direction;
3. milliseconds of the processor for a call, while other programs run;
4. flights at walls through the real firmware, with the distance in which the switch stops the vehicle where
   it ended them.""",
    "controllers": """
Flights of VIS-R at 100 Hz with poses that are 30 ms old and noisy, and 10 ms from the command to the rate
loop. Through the firmware, the bridge does not know the age of the poses, so a circle is flown late by that age.
The bridge's throttle map learns the mass. There INDI is told the speeds of the rig's rotors, because the
SITL measures none. `pid` is the default ([which one](flying.md#hover-controllers)). The tables after the
first one have the percent of 250 unseen starts that succeed under stress, by the worst criterion. They are
flown by the zoo's policy and by each controller in its place, under the policy's contract: at 30 Hz, 60 ms
late. The controllers race at 3 m/s, the policy as fast as it can.""",
    "firmware_faults": """
Each fault five times, on the packaged Betaflight 4.6. On a SITL of 2026.6.1, built from its source
and flown by `e2efly firmware --binary`, each of the 35 ended as documented, 2 of 2.""",
    "fault_campaign": """
240 flights. The worst values are of the flights that break no rule beyond the bridge. The meaning of
each mode and rule, and the eight flights: [faults](faults.md#faults-by-chance-the-campaign).""",
}
"""What a reader must know beside a table."""


def noise() -> None:
    """The pictures of docs/noise.md: a corridor seen by a D435i, and an IMU at rest."""
    import numpy as np
    from noise_plots import plot_depth_noise, plot_image_noise, plot_imu
    from PIL import Image

    from e2efly.config import ImuConfig
    from e2efly.environment import random_key
    from e2efly.simulation.scenes.camera import PRESETS
    from e2efly.viewing.image_plots import look_around, sized
    from e2efly.viewing.places import find_place

    place, camera = find_place("corridor", random_key(0)), sized(PRESETS["d435i"], 320, None, None)
    sight = look_around(camera, place.scene, 0.0, np.array([0.5, 0.0, 1.5]), np.array([1.0, 0.0, 0.0, 0.0]))
    plot_depth_noise(sight, random_key(1), DOCS / "noise_depth.png")
    mask = (sight.images["label"] == 2).astype(np.float32)
    plot_image_noise(sight, mask, random_key(2), DOCS / "noise_image.png")
    plot_imu(ImuConfig(), random_key(3), DOCS / "noise_imu.png")
    for path in DOCS.glob("noise_*.png"):
        with Image.open(path) as picture:
            small = picture.convert("RGB").quantize(256, dither=Image.Dither.NONE)
        small.save(path, optimize=True)


def families() -> None:
    """docs/any_vehicle.png: what the ranges of `any` draw."""
    from family_plot import plot_family
    from PIL import Image

    from e2efly.vehicles.family import load_family

    family, path = load_family("any"), DOCS / "any_vehicle.png"
    assert family is not None
    plot_family(family, path)
    with Image.open(path) as picture:
        small = picture.convert("RGB").quantize(256, dither=Image.Dither.NONE)
    small.save(path, optimize=True)


def thrown() -> None:
    """docs/thrown.png: success while learning to catch a thrown vehicle, by environment steps and by seconds."""
    import numpy as np

    from e2efly.viewing.style import CYCLE, figure

    path = RESULTS / "thrown.json"
    if not path.exists():
        return
    curves = json.loads(path.read_text())["curves"]
    notes = [
        "success over 250 starts; line: median of 5 seeds, band: worst to best; seconds from process start, empty cache"
    ]
    with figure(DOCS / "thrown.png", "Catching a thrown vehicle", 3.6, notes) as fig:
        axes = fig.subplots(1, 2)
        for color, curve in zip(CYCLE, curves, strict=False):
            success = 100 * np.array([seed["success"] for seed in curve["seeds"]])
            for ax, unit, scale in zip(axes, ("steps", "seconds"), (1e-6, 1.0), strict=True):
                x = scale * np.median([seed[unit] for seed in curve["seeds"]], axis=0)
                ax.fill_between(x, success.min(axis=0), success.max(axis=0), color=color, alpha=0.12, linewidth=0)
                ax.plot(x, np.median(success, axis=0), color=color, label=curve["algorithm"].upper())
        for ax, label in zip(axes, ("environment steps (million)", "time (s)"), strict=True):
            ax.set_xlabel(label)
        axes[0].set_xscale("log")
        axes[0].set_ylabel("success (%)")
        axes[1].set_ylim(97.0, 100.1)
        axes[1].legend(loc="lower right")


def cold_start() -> None:
    """docs/cold_start.png: where a training spends its time, a stacked bar for each command."""
    from e2efly.viewing.style import CYCLE, figure

    rows = json.loads((RESULTS / "cold_start.json").read_text())["table"]
    heads = list(rows[0])
    parts = heads[heads.index("imports") : heads.index("whole")]
    with figure(DOCS / "cold_start.png", "Where a training spends its time", 1.2 + 0.4 * len(rows)) as fig:
        ax = fig.subplots()
        names, begun = [f"{row['task']}, {row['when']}" for row in rows], [0.0] * len(rows)
        for i, part in enumerate(parts):
            seconds = [float(row[part]) for row in rows]
            pale = 0.45 if i >= len(CYCLE) else 1.0
            ax.barh(names, seconds, left=begun, color=CYCLE[i % len(CYCLE)], alpha=pale, label=part)
            begun = [before + more for before, more in zip(begun, seconds, strict=True)]
        for i, whole in enumerate(begun):
            ax.text(whole, i, f" {whole:.0f} s", va="center")
        ax.invert_yaxis()
        ax.margins(x=0.1)
        ax.set_axisbelow(True)
        ax.set_xlabel("time from the start of the process (s)")
        fig.legend(*ax.get_legend_handles_labels(), loc="outside right center")


def any_track() -> None:
    """docs/any_track.png: the first tracks that the sampler draws from a seed, from above."""
    import numpy as np
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    from e2efly.courses.random_tracks import RACING, random_tracks
    from e2efly.viewing.style import GREY, PALE, SPEED, START, figure

    tracks = random_tracks(np.random.default_rng(7).random((15, *RACING.numbers()), np.float32))
    notes = [
        "from above; gates as wide as their openings, coloured by height; arrows: flown through that way",
        "numbers: order of the gates; circle: start; grey: straight from gate to gate",
    ]
    height = Normalize(0.5, 7.0)
    path = DOCS / "any_track.png"
    with figure(path, "Tracks by chance", 7.2, notes) as fig:
        axes = fig.subplots(3, 5)
        for world, ax in enumerate(axes.ravel()):
            t = tracks.track(world)
            way = np.vstack([t.start, t.position, *([t.position[:1]] if t.closed else [])])
            ax.plot(way[:, 0], way[:, 1], color=PALE, linewidth=1.0)
            ax.plot(*t.start[:2, None], **START)
            along = np.stack([np.cos(t.yaw), np.sin(t.yaw)], axis=-1)
            left = t.opening[:, :1] / 2 * np.stack([-along[:, 1], along[:, 0]], axis=-1)
            size = np.ptp(way[:, :2], axis=0).max()
            for i, (place, a, half) in enumerate(zip(t.position, along, left, strict=True)):
                color = SPEED(height(place[2]))
                ends = np.stack([place[:2] - half, place[:2] + half])
                ax.plot(*ends.T, color=color, linewidth=3)
                tip = place[:2] + 0.14 * size * a
                ax.annotate("", tip, place[:2], arrowprops={"arrowstyle": "->", "color": color, "linewidth": 1.2})
                off = place[:2] + (0.05 + 0.035 * (i % 2)) * size * np.array([-a[1], a[0]])
                ax.text(*off, str(i + 1), size=7, ha="center", va="center", color=GREY)
            ax.set_aspect("equal", adjustable="datalim")
            ax.margins(0.1)
            ax.tick_params(labelsize=7)
        fig.colorbar(ScalarMappable(height, SPEED), ax=axes, shrink=0.5, aspect=40, label="height of a gate (m)")


@cache
def today(command: str) -> str:
    """The fingerprint that the configuration of a command has today."""
    return fingerprint(recorded(command).config)


def results(name: str) -> dict[str, Any]:
    """A file of results, in whose table what was measured with another configuration is marked as earlier."""
    content = json.loads((RESULTS / f"{name}.json").read_text())
    recorded = {run["configuration"]: run["command"] for run in content.get("runs", []) if "command" in run}
    content["recorded"] = bool(recorded)
    for row in content["table"]:
        known, usual = row.get("configuration"), EnvConfig().integrator
        if (known in recorded and today(recorded[known]) != known) or (row.get("integrator") or usual) != usual:
            row["configuration"] = f"{known}, {EARLIER}"
    return content


def place(content: dict[str, Any]) -> str:
    """What something was measured on."""
    m = content["machine"]
    avx512 = {True: " with AVX-512", False: " without AVX-512"}.get(m.get("avx512"), "")
    return f"{m['cores']} cores of {m['cpu']}{avx512}, JAX {m['jax']}"


def integrators(content: dict[str, Any]) -> str:
    """The integrators by which something was measured."""
    return " and ".join(sorted({run["integrator"] for run in content.get("runs", []) if "integrator" in run})) or "-"


def benchmarks() -> str:
    """The page of all tables."""
    source = "Written by `make docs` from `benchmarks/results/*.json`; measured by the scripts in `benchmarks/`."
    lines = ["# Benchmarks", "", source, "", FIRST.strip(), ""]
    for name, title in TITLES.items():
        if not (RESULTS / f"{name}.json").exists():
            continue
        content, policies = results(name), POLICIES[name]
        about = f"`benchmarks/{SCRIPTS.get(name, f'{name}.py')}`, {content['date']}, {place(content)}."
        if policies != NONE:
            about += f" Policies: {policies}"
            about += "." if content["recorded"] or policies == ZOO else " of that day; its configuration was not kept."
        note = [NOTES[name].strip(), ""] if name in NOTES else []
        lines += [f"## {title}", "", about, "", *note, *markdown(content["table"]), ""]
        for rows in content.get("tables", []):
            lines += [*markdown(rows), ""]
    return "\n".join(lines)


def readme() -> str:
    """README.md with the table of its figures."""
    text = (DOCS.parent / "README.md").read_text(encoding="utf-8")
    before, rest = text.split(BEGIN)
    return f"{before}{BEGIN}\n{figures()}\n{END}{rest.split(END)[1]}"


def figures() -> str:
    """The table of README.md."""
    times, typed, rates, images = map(results, ("time_to_criterion", "cold_start", "rates", "rendering"))
    by = {(row["algorithm"], row["task"]): row for row in times["table"]}

    def marked(text: str, row: dict[str, Any]) -> str:
        return text if EARLIER not in row.get("configuration", EARLIER) else f"{text} ({EARLIER})"

    def cell(algo: str, goal: str) -> str:
        row = by.get((algo, goal))
        return "-" if row is None else marked(f"{row['cold, s (median)']} / {row['warm, s (median)']} s", row)

    rows = []
    for goal, title in GOALS.items():
        paper = [by[algo, goal]["paper, s"] for algo in ("ppo", "bptt") if (algo, goal) in by]
        theirs = f"{paper[0]} / {paper[1]} s" if len(paper) == 2 and "-" not in paper else "-"
        preset = next((row["preset"] for row in by.values() if row["task"] == goal and "preset" in row), "-")
        rows.append((title, preset, cell("ppo", goal), cell("bptt", goal), theirs))
    for task in ("hover", "race"):
        first, later = (row for row in typed["table"] if row["task"] == task)
        told = f"{float(first['whole']):.0f} / {float(later['whole']):.0f} s"
        kinds = [name for name in first if "vehicle" in name and first[name] != "-"]
        success = [f"{name.removesuffix(', %')} {min(first[name].split(), key=float)} %" for name in kinds]
        told = marked("; ".join([told, ", ".join(success)] if success else [told]), first)
        rows.append((f"`e2efly train {task}` as typed, to its end", first.get("preset", "-"), "-", told, "-"))
    lines = [
        "| | preset | PPO, first / later | BPTT, first / later | the paper, RTX 4090, PPO / BPTT |",
        "| --- | --- | --- | --- | --- |",
        *(f"| {' | '.join(row)} |" for row in rows),
    ]
    rate = {row["what"]: row for row in rates["table"]}
    physics = next(row for what, row in rate.items() if "physics sub-steps" in what and what.endswith("vehicles"))
    ratio = rate["ratio, physics over the best of the others"]["per second"]
    depth = next(row for row in images["table"] if row["image"] == "depth 64x64")
    fast = f"{float(physics['per second'].replace(',', '')) / 1e6:.0f} million sub-steps per second"
    notes = [
        f"Physics: {marked(fast, physics)}, integrator {physics.get('integrator', '-')}, {float(ratio):.1f} times the "
        f"best of four peers ({rates['date']}, {place(rates)}).",
        f"Depth images, 64 x 64: {float(depth['frames/s, median']):,.0f} per second, {float(depth[EMBREE]):.0f} times "
        f"Embree ({images['date']}, {place(images)}).",
        f"Times: {times['date']}, {place(times)}, integrator {integrators(times)}; as typed: {typed['date']}, "
        f"{place(typed)}, integrator {integrators(typed)}." + (NOT_TODAY if EARLIER in str(rows) else ""),
    ]
    return "\n".join([*lines, *(f"\n{textwrap.fill(note, 120)}" for note in notes)])


def main() -> None:
    """Write docs/benchmarks.md, the table of README.md and pictures; with `--noise` draw docs/noise.md, with
    `--tracks` any_track.png; with `--pictures` the racer, too.
    """
    (DOCS / "benchmarks.md").write_text(benchmarks(), encoding="utf-8")
    (DOCS.parent / "README.md").write_text(readme(), encoding="utf-8")
    thrown()
    cold_start()
    families()
    if "--noise" in sys.argv or "--pictures" in sys.argv:
        noise()
    if "--tracks" in sys.argv or "--pictures" in sys.argv:
        any_track()
    if "--pictures" in sys.argv:
        with tempfile.TemporaryDirectory() as folder:
            run = Path(folder) / "run"
            subprocess.run([sys.executable, "-m", "e2efly", "train", "race", "--out", str(run)], check=True)
            for name in ("flights_race", "learning", "time_race"):
                shutil.copy(run / "plots" / f"{name}.png", DOCS / f"{name}.png")


if __name__ == "__main__":
    main()
