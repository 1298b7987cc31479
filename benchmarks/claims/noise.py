"""Noise of sensors and curricula: trained with and without."""

from typing import Any

from claims.alignment import FLIES, JUDGED, LOST, NOMINAL, flies, flights_table
from claims.experiment import Experiment, Flight, Run
from claims.found import Found
from claims.learning import shipped
from claims.rule import UNMEASURED, Case, Claim, Invented, Side, mean, percents

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


def left(found: Found, task: str, variant: str) -> dict[str, float]:
    """The success of a policy in each noise."""
    own = {"task": task, "variant": variant}
    names = [set(one["flights"]) - {CLEAN} for one in found.of(**own)]
    return {name: mean(found.flown(name, **own)) for name in sorted(set.intersection(*names))} if names else {}


def noiseless(tasks: tuple[str, ...], fly: bool) -> Any:
    """Whether policies trained without noise succeed as often in the worst noise, or less, as is claimed."""

    def cases(found: Found) -> list[Case]:
        out = []
        for task in tasks:
            own = {"task": task, "variant": CLEAN}
            if in_noise := left(found, task, CLEAN):
                still, worst = mean(found.flown(CLEAN, **own)), min(in_noise, key=lambda name: in_noise[name])
                right = (in_noise[worst] > still - LOST) == fly
                told = f"{100 * in_noise[worst]:.1f} % {worst}, {100 * still:.1f} % {CLEAN}"
                out.append(Case(task, right, flies(found, CLEAN, **own), told, (Side(found.of(**own)),)))
        return out

    return cases


def depth_helps(found: Found) -> list[Case]:
    """Whether noise of inverse depth in training leaves more success in the worst noise, by more than what counts as
    lost, and a policy that flies.
    """
    out = []
    plain = left(found, "avoid", CLEAN)
    for sigma in SIGMAS:
        noisy = left(found, "avoid", deep(sigma))
        if both := sorted(set(plain) & set(noisy)):
            worst = min(both, key=lambda name: plain[name])
            without, given = plain[worst], min(noisy[name] for name in both)
            right = given > without + LOST and given > FLIES - LOST
            sides = tuple(Side(found.of(task="avoid", variant=variant)) for variant in (CLEAN, deep(sigma)))
            learns = all(flies(found, CLEAN, task="avoid", variant=variant) for variant in (CLEAN, deep(sigma)))
            told = f"{100 * without:.1f} % {worst} without, {100 * given:.1f} % with"
            out.append(Case("avoid", right, learns, told, sides, f"{sigma:g}/m"))
    return out


NUMBERS = (
    Invented("strength of the noise of inverse depth", "0.03 to 0.05 1/m, as in the authors' public code",
             by="trained with 0.005, 0.03 and 0.05 1/m, flown with up to 0.1 1/m"),
    Invented("noise of a real camera", "models of a D435i, of Redwood, of masks", by="flown in each of them"),
    Invented("density and speed of the forest", "the preset `nominal`"),
)  # fmt: skip
"""What the paper does not give."""

NOISE = Experiment(
    "noise",
    "Trained without noise and with, flown under each",
    "table *The type of noise provided in E2E-Fly*; section *Noise Modeling*",
    (
        Claim("State-based tasks transfer without noise in training", "zero-shot", noiseless(STATE_BASED, fly=True), 2,
              JUDGED[::2], "success, trained without noise; flown with the worst and with none"),
        Claim("Tasks by sight need noise in training", "no figure", noiseless(("land_visual", "avoid"), fly=False), 2,
              NUMBERS, "success, trained without noise; flown with the worst and with none"),
        Claim("Noise of inverse depth in training narrows the gap", "no figure", depth_helps, 1, NUMBERS,
              "success in the noise that is the worst without it, and with it in its worst; narrower: "
              f"{100 * LOST:.0f} points more"),
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
pepper (5 %) and Gaussian noise (0.2). The flight through the forest is trained with noise of inverse depth in all
episodes, or with a D435i's noise. The table has the percent of 1000 unseen starts that succeed, by the worst criterion,
one number per seed.""",
    seeds=3,
)  # fmt: skip


STEPS = 100_000_000
"""The paper's, of racing in clutter by PPO."""
LEARNERS = {
    "paper": ("--preset", "paper", "--env.past-actions", "0"),
    "authors": ("--preset", "authors", "--env.past-actions", "0"),
    "ours": ("--preset", "nominal", "--steps", str(STEPS)),
    "ours, fewer steps": ("--preset", "nominal"),
}
"""Whose preset: its rewards, network and sizes of a batch. The stages of the curriculum are ours."""


def helps(found: Found) -> list[Case]:
    """Whether PPO with the curriculum succeeds more often than without, by more than 2 points."""
    out = []
    for whose in LEARNERS:
        for task in ("avoid", "race_clutter"):
            both = [found.of(task=task, variant=f"{whose}, {variant}") for variant in ("curriculum", "one step")]
            if all(both):
                rates = [[shipped(one) for one in runs] for runs in both]
                told = f"{percents(rates[0])} % with, {percents(rates[1])} % without"
                learns = max(mean(own) for own in rates) >= FLIES
                sides = tuple(Side(runs, STEPS) for runs in both)
                out.append(Case(task, mean(rates[0]) > mean(rates[1]) + 0.02, learns, told, sides, whose))
    return out


CURRICULUM = Experiment(
    "curriculum",
    "Curriculum against none",
    "section *Curriculum Learning*",
    (
        Claim(
            "Complex tasks trained in one step converge to local optima, with curricula not",
            "no figure",
            helps,
            2,
            (
                Invented(
                    "rewards, network, size of a batch", "the preset `paper`", ("ours, curriculum", "ours, one step")
                ),
                Invented(
                    "number of obstacles, speeds, scale of the tracks",
                    "ours",
                    ("authors, curriculum", "authors, one step"),
                    tasks=("race_clutter",),
                ),
                Invented("density of the forest, speeds", "ours", tasks=("avoid",)),
                Invented("stages of the curriculum", "no obstacles, few, all"),
            ),
            "success on 1000 unseen starts, by the worst criterion; the same: 2 points more",
        ),
    ),
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
            "success, %": percents([shipped(one) for one in own]) if own else UNMEASURED,
            "M steps": " ".join(f"{one['steps'] / 1e6:.1f}" for one in own) or "-",
        }
        for run in CURRICULUM.runs
    ],
    """
PPO with its curriculum (no obstacles, few, all) and with `--no-curriculum`, in equal steps. A case says something only
if one of the two flies the task at the end (90 %). By the preset `authors` neither finishes a lap of the S-shaped
track; of the 3D circle and the J-shaped track the one with a curriculum flies 86 and 51 %, the one without 89 and
82 %.""",
    seeds=3,
)
