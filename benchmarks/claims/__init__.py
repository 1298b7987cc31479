"""The paper's experiments, one after the other."""

from claims.ablations import ABLATION
from claims.alignment import IDENTIFICATION, LATENCY, RANDOMISATION
from claims.elsewhere import REAL, RENDERING, SIM_TO_SIM, STEPS
from claims.experiment import Experiment
from claims.learning import LEARNING
from claims.noise import CURRICULUM, NOISE
from claims.times import HOURS, SPEED
from claims.vision import LANDING, RACING

EXPERIMENTS: dict[str, Experiment] = {
    experiment.name: experiment
    for experiment in (
        LEARNING, SPEED, HOURS, ABLATION, LANDING, RACING, STEPS, REAL, LATENCY, RANDOMISATION, IDENTIFICATION, NOISE,
        CURRICULUM, SIM_TO_SIM, RENDERING,
    )
}  # fmt: skip
"""By name, in the order of the page."""
