"""Figures of the paper that other benchmarks have measured already, and those that nothing here can measure."""

from typing import Any

from claims.experiment import CONFIRMED, NOTHING, REFUTED, UNTESTABLE, Claim, Experiment, Found, Verdict


def aligned(found: Found) -> Verdict:
    """Whether alignment brings the simulator's step response to the firmware's."""
    known = found.results("step_response")
    if known is None:
        return NOTHING
    rms = known["steps"]["held_out_rms"]
    rates = {name: of for name, of in rms.items() if name.endswith("_rate")}
    told = "; ".join(
        f"{name.replace('_', ' ')}: {of['before']:.3f} to {of['aligned']:.3f} {of['unit']}"
        for name, of in rms.items()
        if name in rates or name == "thrust"
    )
    right = all(of["aligned"] < 0.5 * of["before"] for of in rates.values())
    why = "error in steps that the fit did not see, before and after; confirmed if that of every rate is halved"
    return Verdict(CONFIRMED if right else REFUTED, told, why)


def table_of(name: str) -> Any:
    """The rows of another benchmark."""

    def rows(found: Found) -> list[dict[str, str]]:
        known = found.results(name)
        return known["table"] if known else []

    return rows


STEPS = Experiment(
    "step_response",
    "Step response",
    "figure of the step-response alignment",
    (Claim("After alignment, the simulator's step response matches the vehicle's", "curves coincide", aligned),),
    (),
    table_of("step_response"),
    made_of=("step_response",),
    about="""
The real firmware takes the place of the vehicle, on a simulated body ([how](identification.md#align)). The table has
the time until 10 % and 63 % of the step, and the overshoot.

![Steps through real Betaflight firmware, and the simulator](step_response.png)""",
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


def transfers(found: Found) -> Verdict:
    """Whether no policy loses more than a few points."""
    table = plant_rows(found)
    if not table:
        return NOTHING
    drops = {f"{row['criterion']} on {row['plant']}": float(row["drop, points"]) for row in table}
    allowed = [max(DROP, 100 / int(row["flights"])) for row in table]
    right = all(drop <= most for drop, most in zip(drops.values(), allowed, strict=True))
    worst = max(drops, key=lambda name: drops[name])
    ours = f"{len(drops)} cases; worst: {worst}, {drops[worst]:.1f} points"
    return Verdict(CONFIRMED if right else REFUTED, ours, f"at most {DROP:.0f} points or one flight may be lost")


SIM_TO_SIM = Experiment(
    "sim_to_sim",
    "Sim-to-sim",
    "section Sim-to-sim: From VisFly to AirSim",
    (Claim("Policies transfer to another simulator without a change", "in AirSim, no figure", transfers),),
    (),
    plant_rows,
    made_of=tuple(PLANTS),
    about="""
The plants are MuJoCo, the real Betaflight firmware on a simulated body, and a server that speaks AirSim's RPC. AirSim
itself was not used for these figures. The vehicle is VIS-R. The policies by BPTT are those of the zoo; those by PPO are
trained with its presets `nominal`.""",
)

FRAMES = 6000


def frames(found: Found) -> Verdict:
    """Frames of 256x256 depth."""
    known = found.results("rendering")
    row = next((row for row in known["table"] if row["image"] == "depth 256x256"), None) if known else None
    if row is None:
        return NOTHING
    rate = float(row["frames/s, median"])
    why = "two CPU cores, worlds of solids; theirs on a GPU, scenes of meshes"
    return Verdict(CONFIRMED if rate >= FRAMES else REFUTED, f"{rate:,.0f} per second", why)


def not_here(why: str) -> Any:
    """A judge of what nothing here can measure."""
    return lambda found: Verdict(UNTESTABLE, why=why)


RENDERING = Experiment(
    "rendering",
    "Rendering",
    "section Fast Rendering Simulator",
    (Claim("Depth images of 256x256", "up to 6000 per second", frames),),
    (),
    table_of("rendering"),
    made_of=("rendering",),
)

NEEDS = "needs the vehicle"
FLIGHTS = "benchmarks.md#whole-flights-through-real-betaflight-firmware-nobody-helping"
REAL = Experiment(
    "real",
    "What needs a vehicle",
    "figures of the policy response, of zero-shot transfer, of hardware in the loop; table of vehicle parameters",
    (
        Claim("Zero-shot transfer of all tasks to VIS-R", "shown by flights, without a success rate",
              not_here(f"{NEEDS}; [flights through the real firmware]({FLIGHTS}) take their place")),
        Claim("The policy's response in flight matches the simulator's", "curves coincide", not_here(NEEDS)),
        Claim("Hardware in the loop on VIS-H, racing with random obstacles", "shown by a flight",
              not_here("needs the vehicle and motion capture; [rehearsed](hil.md) without them")),
        Claim("The latency is 90 ms by telemetry and below 30 ms on board", "90 ms, 30 ms", not_here(NEEDS)),
        Claim("Parameters of VIS-R and VIS-H", "table of parameters",
              not_here("needs the vehicles; inertia [by a list of parts](identification.md) is compared")),
        Claim("Costs of 630 and 280 USD", "630, 280 USD", not_here("prices depend on day and place")),
    ),
)  # fmt: skip
