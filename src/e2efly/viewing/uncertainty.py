"""Plot of the uncertainty of an identification: the distribution from which `--env.randomize identified` draws."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from e2efly.vehicles.posterior import Posterior
from e2efly.viewing.style import BLUE, INK, VERMILLION, figure

DRAWS = 500
"""Number of vehicles that are shown."""
PAIRS = 3
"""Number of the most correlated pairs of parameters, each shown in its own panel."""
_SCALES = {"latency": (1e3, "ms"), "centre_of_mass": (1e3, "mm"), "inertia_products": (1e6, "kg mm²")}
WITHIN = np.sqrt(-2 * np.log(0.1))
"""Number of standard deviations of a two-dimensional normal distribution that contain 90 % of it."""


def plot_posterior(path: Path, posterior: Posterior) -> None:
    """Draw the correlations of all entries, and samples of the most correlated ones.

    Args:
        path: the PNG file.
        posterior: the posterior of a vehicle file, with at least one entry.
    """
    covariance = posterior.root @ posterior.root.T
    spread = np.sqrt(np.diag(covariance))
    matrix = covariance / np.outer(spread, spread)
    rows, columns = np.triu_indices(len(matrix), 1)
    most = np.argsort(-np.abs(matrix[rows, columns]), kind="stable")[:PAIRS]
    draws = posterior.deviation(np.random.default_rng(0).standard_normal((DRAWS, posterior.root.shape[1])))
    notes = [
        "left: correlation of the errors of the parameters, with their standard deviations",
        f"right: {DRAWS} vehicles that --env.randomize identified draws, with the ellipse that holds 90 % of them",
    ]
    height = 2.6 + 0.3 * len(matrix) if len(most) else 2.0 + 0.3 * len(matrix)
    with figure(path, "What the identification leaves open", max(height, 3.6), notes) as fig:
        grid = fig.add_gridspec(max(len(most), 1), 2, width_ratios=(2.4, 1) if len(most) else (1, 0.01))
        _matrix(fig.add_subplot(grid[:, 0]), posterior, matrix)
        for n, pair in enumerate(most):
            at = [int(rows[pair]), int(columns[pair])]
            _pair(fig.add_subplot(grid[n, 1]), posterior, at, covariance[np.ix_(at, at)], draws[:, at])


def _matrix(ax: Axes, posterior: Posterior, matrix: np.ndarray) -> None:
    ax.imshow(matrix, cmap="RdBu_r", vmin=-1, vmax=1, aspect="auto")
    places = np.arange(len(matrix))
    ax.set_xticks(places, [_label(name) for name in posterior.sigma], rotation=90)
    ax.set_yticks(places, [f"{_label(name)}  {_size(name, sigma)}" for name, sigma in posterior.sigma.items()])
    ax.grid(visible=False)
    for i in range(len(matrix)):
        for j in range(i):
            if abs(matrix[i, j]) >= 0.1:
                dark = abs(matrix[i, j]) > 0.6
                ax.text(j, i, f"{matrix[i, j]:.1f}", ha="center", va="center", size=7, color="white" if dark else INK)


def _pair(ax: Axes, posterior: Posterior, at: list[int], covariance: np.ndarray, draws: np.ndarray) -> None:
    scale = np.array([_scale(posterior.entries[i].name)[0] for i in at])
    ax.plot(*(draws * scale).T, ".", color=BLUE, markersize=2, alpha=0.6)
    values, vectors = np.linalg.eigh(covariance)
    angle = np.linspace(0, 2 * np.pi, 100)
    circle = np.stack([np.cos(angle), np.sin(angle)])
    ellipse = vectors @ (WITHIN * np.sqrt(np.maximum(values, 0))[:, None] * circle)
    ax.plot(*(ellipse * scale[:, None]), color=VERMILLION)
    names = [posterior.entries[i].name for i in at]
    ax.set_xlabel(f"{_label(names[0])} ({_scale(names[0])[1]})")
    ax.set_ylabel(f"{_label(names[1])} ({_scale(names[1])[1]})")


def _label(name: str) -> str:
    return name.replace("_", " ")


def _scale(name: str) -> tuple[float, str]:
    """Factor and unit in which a deviation is shown: per cent, unless it is added."""
    return _SCALES.get(name.split("[")[0], (100.0, "%"))


def _size(name: str, sigma: float) -> str:
    factor, unit = _scale(name)
    return f"{factor * sigma:.2g} {unit}"
