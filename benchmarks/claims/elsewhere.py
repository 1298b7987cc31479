"""Figures of the paper that other benchmarks have measured already, and those that nothing here can measure."""

from pathlib import Path
from typing import Any

from claims.experiment import Experiment
from claims.found import Found
from claims.rule import Case, Claim
from e2efly import vehicles
from e2efly.alignment.parts import read_parts


def aligned(found: Found) -> list[Case]:
    """Whether alignment brings the simulator's step response to the firmware's, in each rate of the body."""
    known = found.results("step_response")
    rms = known["steps"]["held_out_rms"] if known else {}
    return [
        Case(name.replace("_", " "), of["aligned"] < 0.5 * of["before"], True,
             f"{of['before']:.3f} to {of['aligned']:.3f} {of['unit']}")
        for name, of in rms.items()
        if name.endswith("_rate")
    ]  # fmt: skip


def table_of(name: str) -> Any:
    """The rows of another benchmark."""

    def rows(found: Found) -> list[dict[str, str]]:
        known = found.results(name)
        return known["table"] if known else []

    return rows


STEPS = Experiment(
    "step_response",
    "The step-response alignment",
    "figure of this caption",
    (
        Claim(
            "After alignment, the simulator's step response matches the vehicle's",
            "curves coincide",
            aligned,
            3,
            why="error in steps that the fit did not see, before and after; the same: it is halved",
        ),
    ),
    (),
    table_of("step_response"),
    made_of=("step_response",),
    about="""
The real firmware takes the place of the vehicle, on a simulated body ([how](identification.md#align)). The table has
the time until 10 % and 63 % of the step, and the overshoot.""",
)

DROP = 2.0
"""Points of success that a policy may lose on a plant, as `e2efly validate` allows; or a single flight."""
PLANTS = {"sim_to_sim": "the PPO presets", "airsim": "the zoo", "plants_by_sight": "the zoo"}


def plant_rows(found: Found) -> list[dict[str, str]]:
    """One row per file, criterion and plant: success in training and on the plant."""
    out = []
    for name, policies in PLANTS.items():
        known = found.results(name) or {"table": ()}
        for row in known["table"]:
            plant = row.get("plant", "AirSim's RPC")
            if plant != "simulator":
                here = row.get("success in training's simulator", row.get("in training"))
                there = row.get("on the plant", row.get("over AirSim's RPC"))
                out.append({
                    "criterion": row["criterion"], "policies": policies, "plant": plant,
                    "flights": str(row.get("starts", known.get("episodes"))), "in training": here,
                    "on the plant": there, "drop, points": row["drop, points"],
                })  # fmt: skip
    return out


def transfers(found: Found) -> list[Case]:
    """Whether no policy loses more than a few points."""
    out = []
    for row in plant_rows(found):
        name, drop = f"{row['criterion']} of {row['policies']} on {row['plant']}", float(row["drop, points"])
        out.append(Case(name, drop <= max(DROP, 100 / int(row["flights"])), True, f"{drop:.1f} points lost"))
    return out


SIM_TO_SIM = Experiment(
    "sim_to_sim",
    "Sim-to-sim",
    "section *Sim-to-sim: From VisFly to AirSim*",
    (
        Claim(
            "Policies transfer to another simulator without a change",
            "in AirSim, no figure",
            transfers,
            24,
            why=f"at most {DROP:.0f} points or one flight may be lost",
        ),
    ),
    (),
    plant_rows,
    made_of=tuple(PLANTS),
    about="""
The plants are MuJoCo, the real Betaflight firmware on a simulated body, and a server that speaks AirSim's RPC. AirSim
itself was not used for these figures. The vehicle is VIS-R. The policies by BPTT are those of the zoo; those by PPO are
trained with its presets `nominal`.""",
)

FRAMES = 6000


def frames(found: Found) -> list[Case]:
    """Frames of 256x256 depth."""
    known = found.results("rendering")
    rows = [row for row in known["table"] if row["image"] == "depth 256x256"] if known else []
    rates = [float(row["frames/s, median"]) for row in rows]
    return [Case("depth 256x256", rate >= FRAMES, True, f"{rate:,.0f} per second") for rate in rates]


RENDERING = Experiment(
    "rendering",
    "Rendering",
    "section *Fast Rendering Simulator*",
    (
        Claim(
            "Depth images of 256x256",
            "up to 6000 per second",
            frames,
            why="two CPU cores, worlds of solids; theirs on a GPU, scenes of meshes",
            theirs_alone="a property of the machine",
        ),
    ),
    (),
    table_of("rendering"),
    made_of=("rendering",),
)

PRICES = {"vis_r": 630, "vis_h": 280}
"""The paper's, USD."""
DEARER = 0.25
"""Share by which our list may differ from the paper's price."""
PARTS = Path(vehicles.__file__).parent / "parts"


def prices(found: Found) -> list[Case]:
    """What the parts that fly cost by our lists, without the battery as in the paper, beside the paper's price."""
    del found
    out = []
    for name, theirs in PRICES.items():
        parts = [part for part in read_parts(PARTS / f"{name}.toml") if not part.battery]
        cost = sum(len(part.places) * (part.purchase.price or 0.0) for part in parts)
        near = abs(cost - theirs) <= DEARER * theirs
        out.append(Case(name.upper().replace("_", "-"), near, True, f"{cost:.0f} USD, theirs {theirs}"))
    return out


NEEDS = "needs the vehicle"
FLIGHTS = "benchmarks.md#whole-flights-through-real-betaflight-firmware-nobody-helping"
REAL = Experiment(
    "real",
    "Policy response, and what else is about the vehicles",
    "figures *Policy response after step-response alignment*, *Zero-shot transfer from simulation to real world*; "
    "table of vehicle parameters",
    (
        Claim("Zero-shot transfer of all tasks to VIS-R", "shown by flights, without a success rate",
              untestable=f"{NEEDS}; [flights through the real firmware]({FLIGHTS}) take their place"),
        Claim("The policy's response in flight matches the simulator's", "curves coincide",
              untestable=f"{NEEDS}; below, the firmware on a simulated body takes its place"),
        Claim("Hardware in the loop on VIS-H, racing with random obstacles", "shown by a flight",
              untestable="needs the vehicle and motion capture; [rehearsed](hil.md) without them"),
        Claim("The latency is 90 ms by telemetry and below 30 ms on board", "90 ms, 30 ms", untestable=NEEDS),
        Claim("Parameters of VIS-R and VIS-H", "table of parameters",
              untestable="needs the vehicles; inertia [by a list of parts](identification.md) is compared"),
        Claim("The vehicles cost about 630 and 280 USD", "630 and 280 USD", prices, 2,
              why=f"the parts that fly, by the lists for [VIS-R](hardware-vis-r.md) and [VIS-H](hardware-vis-h.md); "
              f"the same: within {100 * DEARER:.0f} %",
              theirs_alone="prices depend on day and place, and the paper has no list of parts"),
    ),
)  # fmt: skip
