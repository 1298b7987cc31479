"""Noise of sensors and curricula: trained with and without."""

from typing import Any

from claims.alignment import FLIES, LOST, NOMINAL, flights_table
from claims.experiment import NOTHING, Claim, Experiment, Flight, Found, Run, Verdict, mean, percents, verdict
from claims.learning import shipped

STATES = {
    "without noise": Flight(),
    "with motion capture's": Flight(
        {"noise.position": 0.005, "noise.velocity": 0.05, "noise.attitude": 0.005, "noise.body_rate": 0.02}
    ),
    "with a VIO's": Flight(
        {"noise.position": 0.02, "noise.velocity": 0.1, "noise.attitude": 0.01, "noise.body_rate": 0.02}
    ),
}
VIO = (
    "--env.noise.position", "0.02", "--env.noise.velocity", "0.1", "--env.noise.attitude", "0.01",
    "--env.noise.body-rate", "0.02",
)  # fmt: skip
MASKS = {
    "without noise": Flight(),
    **{
        f"with {name}": Flight({f"cameras.0.noise.{field}": value})
        for name, field, value in (
            ("Gaussian", "gaussian", 0.2), ("salt and pepper", "salt_and_pepper", 0.05), ("speckle", "speckle", 0.3),
            ("Poisson", "poisson", 16.0),
        )
    },
}  # fmt: skip
MASK = ("--env.cameras.0.noise.salt-and-pepper", "0.05", "--env.cameras.0.noise.gaussian", "0.2")
SIGMAS = (0.005, 0.03, 0.05)
"""Standard deviations of the noise of inverse depth that are trained with, 1/m. The paper gives none; its authors'
public code has 0.03 to 0.05."""
DEPTHS = {
    "without noise": Flight({"cameras.0.noise.d435i": False, "cameras.0.noise_share": 1.0}),
    **{
        f"with inverse depth, {sigma:g}/m": Flight(
            {"cameras.0.noise.d435i": False, "cameras.0.noise.inverse_depth": sigma, "cameras.0.noise_share": 1.0}
        )
        for sigma in (*SIGMAS, 0.1)
    },
    "with a D435i's": Flight({"cameras.0.noise.d435i": True, "cameras.0.noise_share": 1.0}),
    "with Redwood": Flight(
        {"cameras.0.noise.d435i": False, "cameras.0.noise.redwood": "synthetic", "cameras.0.noise_share": 1.0}
    ),
}
CLEAN, NOISY, D435I = "without noise", "with noise", "with a D435i's noise"
DEPTH = ("--preset", "nominal", "--env.cameras.0.noise.no-d435i")
STATE_BASED = ("hover", "race")


def deep(sigma: float) -> str:
    """The variant that is trained with noise of inverse depth, 1/m."""
    return f"with noise of inverse depth, {sigma:g}/m"


def worst_noise(found: Found, task: str, variant: str) -> tuple[str, float] | None:
    """The noise that costs a policy the most success, and what it leaves."""
    runs = found.of(task=task, variant=variant)
    if not runs:
        return None
    names = [name for name in runs[0]["flights"] if name != CLEAN]
    left = {name: mean(found.flown(name, task=task, variant=variant)) for name in names}
    if not left:
        return None
    worst = min(left, key=lambda name: left[name])
    return worst, left[worst]


def noiseless(tasks: tuple[str, ...], flies: bool) -> Any:
    """A judge: whether policies trained without noise succeed as often in the worst noise, or less, as is claimed."""

    def judge(found: Found) -> Verdict:
        told, right = [], []
        for task in tasks:
            if worst := worst_noise(found, task, CLEAN):
                still = mean(found.flown(CLEAN, task=task, variant=CLEAN))
                right.append((worst[1] > still - LOST) == flies)
                told.append(f"{task} {worst[0]}: {100 * worst[1]:.1f} %, {CLEAN}: {100 * still:.1f} %")
        return verdict(right, told, "success, trained without noise; flown with the worst and with none", len(tasks))

    return judge


def depth_helps(found: Found) -> Verdict:
    """Whether noise of depth in training leaves more success in the worst noise, and a policy that flies."""
    clean, noisy = (worst_noise(found, "avoid", variant) for variant in (CLEAN, NOISY))
    if clean is None or noisy is None:
        return NOTHING
    without, given = (f"{100 * left:.1f} % {name}" for name, left in (clean, noisy))
    right = noisy[1] > max(clean[1], FLIES) - LOST and noisy[1] > clean[1]
    told = [f"avoid: {without} when trained without noise; {given} when trained with it"]
    return verdict([right], told, "success with the worst noise", 1)


NOISE = Experiment(
    "noise",
    "Trained without noise and with, flown under each",
    "table of noise; section Noise Modeling",
    (
        Claim("State-based tasks transfer without noise in training", "zero-shot", noiseless(STATE_BASED, flies=True)),
        Claim("Tasks by sight need noise in training", "no figure", noiseless(("land_visual", "avoid"), flies=False)),
        Claim("Noise of inverse depth in training narrows the gap", "no figure", depth_helps),
    ),
    (
        *(
            Run(task, "bptt", variant, (*NOMINAL, *options), STATES)
            for task in STATE_BASED
            for variant, options in ((CLEAN, ()), (NOISY, VIO))
        ),
        Run("land_visual", "bptt", CLEAN, ("--preset", "nominal"), MASKS),
        Run("land_visual", "bptt", NOISY, ("--preset", "nominal", *MASK), MASKS),
        Run("avoid", "bptt", CLEAN, DEPTH, DEPTHS),
        *(
            Run("avoid", "bptt", deep(sigma), (*DEPTH, "--env.cameras.0.noise.inverse-depth", f"{sigma:g}",
                "--env.cameras.0.noise-share", "1"), DEPTHS)
            for sigma in SIGMAS
        ),
        Run("avoid", "bptt", D435I, ("--preset", "nominal"), DEPTHS),
    ),
    lambda found: [
        {"task": row["task"], "trained": row["trained"], "seeds": row["seeds"], "success, %": "; ".join(
            f"{name.removeprefix('flown ')}: {x}" for name, x in row.items() if name.startswith("flown") and x != "-"
        )}
        for row in flights_table(NOISE, found)
    ],
    """
The policies are trained by BPTT with the preset `nominal`. *With noise* means a different noise in each task. Hover and
race, which have the paper's observations, are trained with a VIO's noise. Visual landing is trained with salt and
pepper (5 %) and Gaussian noise (0.2). The flight through the forest is trained with a D435i's noise in half of the
episodes. The table has the percent of 1000 unseen starts that succeed, by the worst criterion, one number per seed.""",
    seeds=3,
)  # fmt: skip


def helps(found: Found) -> Verdict:
    """Whether PPO with the curriculum does better than without."""
    told, right = [], []
    for task in ("avoid", "race_clutter"):
        both = [[shipped(one) for one in found.of(task=task, variant=v)] for v in ("curriculum", "one step")]
        if all(both):
            right.append(mean(both[0]) > mean(both[1]) + 0.02)
            told.append(f"{task}: {percents(both[0])} % with, {percents(both[1])} % without")
    return verdict(right, told, "success on 1000 unseen starts, by the worst criterion", 2)


STEPS = 100_000_000
"""The paper's, of racing in clutter by PPO."""
LEARNERS = {
    "paper": ("--preset", "paper", "--env.past-actions", "0"),
    "ours": ("--preset", "nominal", "--steps", str(STEPS)),
    "ours, fewer steps": ("--preset", "nominal"),
}
"""Whose preset: its rewards, network and sizes of a batch. The stages of the curriculum are ours."""

CURRICULUM = Experiment(
    "curriculum",
    "Curriculum against none",
    "table of curricula; section Curriculum Learning",
    (Claim("Complex tasks trained in one step converge to local optima, with curricula not", "no figure", helps),),
    tuple(
        Run(task, "ppo", f"{whose}, {variant}", (*preset, *options))
        for whose, preset in LEARNERS.items()
        for task in ("avoid", "race_clutter")
        for variant, options in (("curriculum", ()), ("one step", ("--no-curriculum",)))
    ),
    lambda found: [
        {
            "task": run.task,
            "trained": run.variant,
            "seeds": str(len(own := found.of(task=run.task, variant=run.variant))),
            "success, %": percents([shipped(one) for one in own]) if own else NOTHING.word,
            "M steps": " ".join(f"{one['steps'] / 1e6:.1f}" for one in own) or "-",
        }
        for run in CURRICULUM.runs
    ],
    "PPO's preset `nominal`, with its curriculum (no obstacles, few, all) and with `--no-curriculum`; equal steps.",
    seeds=3,
)
