"""What hovering and tracking have in common in the public code of the paper's authors. Imports no JAX."""

from e2efly.config import Sourced
from e2efly.config.run import OURS, VISFLY

PPO_TERMS = ("act3", "goal", "crash")
"""Terms that the paper's table names for PPO, without weights."""


def silent(file: str) -> tuple[Sourced, ...]:
    """Weights that the paper does not give. The constant per step is that of a file of VisFly."""
    constant = Sourced("reward.weights.alive", 0.1, f"{VISFLY}: {file}, base_r")
    return constant, *(Sourced(f"reward.weights.{name}", 1.0, OURS, "ppo") for name in PPO_TERMS)


def authors(file: str) -> tuple[Sourced, ...]:
    """The reward of a file of VisFly, and starts at rest."""
    none = (Sourced(f"reward.weights.{name}", 0.0, f"{VISFLY}: {file} has no such term", "ppo") for name in PPO_TERMS)
    return (
        Sourced("reward.weights.prog2", 0.1 / 9, f"{VISFLY}: {file}, pos_factor"),
        Sourced("reward.weights.ori2", 0.00001, f"{VISFLY}: {file}"),
        *none,
        Sourced("task.velocity", 0.0, f"{VISFLY}: {file}, starts at rest"),
    )
