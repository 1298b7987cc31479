"""The paper's two tasks by sight: landing on pads of any shape, racing in clutter."""

import math

from claims.experiment import (
    CONFIRMED,
    NOTHING,
    REFUTED,
    UNMEASURED,
    Claim,
    Experiment,
    Flight,
    Found,
    Run,
    Verdict,
    mean,
    percents,
)
from claims.learning import SEEN, shipped

OUTLINES = {"0": "disc", "1": "square", "2": "triangle"}
WIDTHS = (0.3, 0.4, 0.5, 0.6, 0.8)
"""Of the pad, m. Training has 0.4 to 0.6, the paper 0.5."""
ZOO, PAPER, AUTHORS = "the zoo's", "the paper's preset", "its authors' preset"
LARGE, OURS = "ours, 64x64", "ours, 16x16"
PADS = {f"{width:g} m": Flight(task={"pad_size": (width, width)}, by="pad_outline") for width in WIDTHS}
SHAPES = {"0.5 m": PADS["0.5 m"]}
LEAST = 0.95
"""Success from which on a task counts as accomplished."""


def every_pad(found: Found) -> Verdict:
    """Whether the shipped policy lands on each shape, of the paper's width."""
    runs = found.of(variant=ZOO)
    if not (runs and "0.5 m" in runs[0]["flights"]):
        return NOTHING
    at = runs[0]["flights"]["0.5 m"]
    told = "; ".join(f"{OUTLINES[name]}: {100 * of['success']:.1f} %" for name, of in at.items())
    right = all(of["success"] >= LEAST for of in at.values())
    return Verdict(CONFIRMED if right else REFUTED, told, "pads of 50 cm, one policy, 1000 starts")


def in_a_million(found: Found) -> Verdict:
    """Whether BPTT learns it in a million steps."""
    told = {v: [shipped(one) for one in found.whole(variant=v)] for v in (PAPER, LARGE, OURS)}
    known = {v: x for v, x in told.items() if x}
    if not known:
        return NOTHING
    right = any(mean(x) >= LEAST for x in known.values())
    shown = "; ".join(f"{v}: {percents(x)} %" for v, x in known.items())
    return Verdict(CONFIRMED if right else REFUTED, shown, "success on 1000 unseen starts after at most 1.1 M steps")


def as_large(found: Found) -> Verdict:
    """Whether 64x64 lands better than ours."""
    large, ours = ([shipped(one) for one in found.whole(variant=v)] for v in (LARGE, OURS))
    if not (large and ours):
        return NOTHING
    why = "the paper has 64x64; 'confirmed' means that its success is higher by more than a point"
    word = CONFIRMED if mean(large) > mean(ours) + 0.01 else REFUTED
    return Verdict(word, f"64x64: {percents(large)} %; 16x16: {percents(ours)} %", why)


def landing_rows(found: Found) -> list[dict[str, str]]:
    """One row per shape of pad, one column per width; then one row per training."""
    runs, out = found.of(variant=ZOO), []
    for number, outline in OUTLINES.items():
        row = {"policy": ZOO, "pad": outline, "seeds": "1" if runs else "0"}
        for width in PADS:
            at = runs[0]["flights"].get(width, {}).get(number) if runs else None
            row[width] = f"{100 * at['success']:.1f}" if at else NOTHING.word
        out.append(row)
    for variant in (PAPER, LARGE, OURS):
        own = found.of(variant=variant)
        row = {"policy": variant, "pad": "any", "seeds": str(len(own))} | dict.fromkeys(PADS, "-")
        row["0.5 m"] = percents([shipped(one) for one in own]) if own else NOTHING.word
        out.append(row)
    return out


LANDING = Experiment(
    "landing",
    "Visual landing by shape and size",
    "figures of vision-based landing and of the rewards of visual tasks",
    (
        Claim("One policy lands on triangles, circles and squares", "all three", every_pad),
        Claim("BPTT needs only 1e6 steps", "1e6", in_a_million),
        Claim("With 64x64 pixels it lands more often than with our 16x16", "not in the paper", as_large),
    ),
    (
        Run("land_visual", "zoo", ZOO, flights=PADS, kind="zoo"),
        Run("land_visual", "bptt", PAPER, ("--preset", "paper", *SEEN), SHAPES),
        Run("land_visual", "bptt", AUTHORS, ("--preset", "authors", *SEEN), SHAPES),
        Run("land_visual", "bptt", OURS, ("--preset", "nominal"), SHAPES),
        Run("land_visual", "bptt", LARGE,
            ("--preset", "nominal", "--env.cameras.0.width", "64", "--env.cameras.0.height", "64"), SHAPES),
    ),
    landing_rows,
    """
The table has the percent of 1000 unseen starts that land within 10 cm of the middle and 5 cm of height, at 0.5 m/s at
most, and upright. The zoo's policy was trained on pads of 0.4 to 0.6 m, of all shapes, with 16x16 pixels. The other
rows are trainings, one number per seed, judged on the pads of their training. The paper's preset has the paper's 1e6
steps.""",
    seeds=3,
)  # fmt: skip

TRACKS = {"s_shaped": "S-shaped", "circle_3d": "3D circle", "j_shaped": "J-shaped"}

THREE = "one policy for three tracks"
RACERS = {
    "paper": ("--preset", "paper", *SEEN),
    "authors": ("--preset", "authors", *SEEN),
    "ours": ("--preset", "nominal", "--steps", "100000000"),
}
"""Whose preset: each trains one policy for all tracks, and one for each."""


def whole_ppo(found: Found) -> Verdict:
    """PPO of the paper's length."""
    runs = found.of(variant=PAPER)
    if not runs:
        return NOTHING
    told = "; ".join(
        f"{called}: {percents([one['shipped'][name]['success'] for one in runs])} %" for name, called in TRACKS.items()
    )
    steps = " ".join(f"{one['steps'] / 1e6:.0f}" for one in runs)
    if not all(one["finished"] for one in runs):
        return Verdict(UNMEASURED, told, f"stopped after {steps} M of 100 M steps")
    right = all(criterion["success"] >= 0.995 for one in runs for criterion in one["shipped"].values())
    return Verdict(CONFIRMED if right else REFUTED, told, "success in 1000 unseen worlds each, after 100 M steps")


def fast(found: Found) -> Verdict:
    """Whether it flies faster than 10 m/s."""
    runs = found.of(variant=ZOO)
    if not runs:
        return NOTHING
    flown = runs[0]["flights"]["its tracks"]
    told = "; ".join(
        f"{TRACKS[name]}: {of['top_speed_m_s']:.1f} m/s, mean {of['mean_speed_m_s'] or math.nan:.1f}"
        for name, of in flown.items()
    )
    right = all(of["top_speed_m_s"] > 10 for of in flown.values())
    return Verdict(CONFIRMED if right else REFUTED, told, "top speed of 1000 flights; mean speed of those that succeed")


def racing_rows(found: Found) -> list[dict[str, str]]:
    """One row per policy and track."""
    out = []
    for run in RACING.runs:
        for name, called in TRACKS.items():
            row = {
                "policy": f"{run.algo.upper()}, {run.variant}" if run.algo != "zoo" else run.variant,
                "track": called,
            }
            own = found.of(variant=run.variant, algo=run.algo)
            of = [one["flights"]["its tracks"][name] if run.kind == "zoo" else one["shipped"][name] for one in own]
            row["seeds"] = str(len(own))
            row["success, %"] = percents([x["success"] for x in of]) if own else NOTHING.word
            row["top speed, m/s"] = " ".join(f"{x['top_speed_m_s']:.1f}" for x in of) or "-"
            row["time of a lap, s"] = " ".join(f"{x['seconds_of_success'] or math.nan:.1f}" for x in of) or "-"
            row["M steps"] = " ".join(f"{one['steps'] / 1e6:.1f}" for one in own if "steps" in one) or "-"
            out.append(row)
    return out


RACING = Experiment(
    "racing",
    "Racing in clutter on the three tracks",
    "figures of racing with obstacles and of the rewards of visual tasks",
    (
        Claim("PPO with a curriculum reaches 100 % on all three tracks", "100 %, 1e8 steps", whole_ppo),
        Claim("Racing in clutter is faster than 10 m/s", "> 10 m/s", fast),
    ),
    (
        Run("race_clutter", "zoo", ZOO, flights={"its tracks": Flight()}, kind="zoo"),
        *(
            Run("race_clutter", "ppo", f"{whose}, {tracks}", (*preset, *options))
            for whose, preset in RACERS.items()
            for tracks, options in (
                (THREE, ()),
                *((called, ("--task.track", name)) for name, called in TRACKS.items()),
            )
        ),
        Run("race_clutter", "ppo", f"ours, fewer steps, {THREE}", ("--preset", "nominal")),
    ),
    racing_rows,
    """
Every world has different obstacles. Gates are up to 0.3 m and 0.2 rad away from their places in the track's file. The
commanded speeds are 4 to 12 m/s. A lap with a collision is not a success. *Ours* is PPO's preset `nominal` with 8 M
steps.""",
    seeds=3,
)
