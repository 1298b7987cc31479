"""Which found corner is which expected one: the assignment that explains all corners of an image best.

Corners look alike, and after a turn without a gate in view all of them may be expected in a wrong place. Matching each
with its nearest neighbour then goes wrong. But one right pair tells where all others are. So every pair is tried: the
state is corrected by it, and the other corners are matched under that correction. The pair under which the corners are
most likely wins (J. Civera et al., 1-point RANSAC for extended Kalman filtering, 2010; here all pairs are tried, and
with their covariances).
"""

import math
from dataclasses import dataclass

import numpy as np

CHANCE = 11.8
"""Largest squared Mahalanobis distance of a right pair: 0.3 % lie beyond."""
CLUTTER = 1e-4
"""Density of found corners that belong to no opening, 1 / pixel^2."""
CLEAR = 3.0
"""An assignment counts beside the best one if the logarithm of its likelihood is less than this below."""


@dataclass(frozen=True)
class Expected:
    """The k corners that are expected in an image."""

    pixel: np.ndarray
    """(k, 2)."""
    slope: np.ndarray
    """(k, 2, s) derivative of the pixels with respect to the state's error."""


def associated(
    expected: Expected, covariance: np.ndarray, found: np.ndarray, alike: np.ndarray, sigma: float
) -> list[tuple[int, int]] | None:
    """Pairs (expected, found).

    Args:
        expected: the expected corners.
        covariance: (s, s) of the state's error.
        found: (f, 2) pixels of the found corners.
        alike: (k, f) which pairs may belong together.
        sigma: standard deviation of a found corner, pixels.

    Returns:
        The pairs, each corner at most once, on which all assignments agree that are nearly as likely as the best one.
            None: no pair is likely.
    """
    slope, count = expected.slope, len(expected.pixel)
    if not count or not len(found):
        return None
    miss = found[None] - expected.pixel[:, None]  # (k, f, 2)
    cross = slope @ covariance  # (k, 2, s)
    joint = np.einsum("aix,bjx->abij", cross, slope)  # covariance of the pixels of corners a and b
    own = joint[np.arange(count), np.arange(count)] + sigma**2 * np.eye(2)
    inverse = np.linalg.inv(own)
    distance = np.einsum("kfi,kij,kfj->kf", miss, inverse, miss)
    first, second = np.nonzero(alike & (distance < CHANCE))
    if not len(first):
        return None
    gain = joint[:, first].transpose(1, 0, 2, 3) @ inverse[first][:, None]  # (c, k, 2, 2): of pair c on corner k
    shifted = np.einsum("ckij,cj->cki", gain, miss[first, second])
    rest = own[None] - gain @ joint[first]  # (c, k, 2, 2): what remains uncertain
    left = miss[None] - shifted[:, :, None]  # (c, k, f, 2)
    far = np.einsum("ckfi,ckij,ckfj->ckf", left, np.linalg.inv(rest), left)
    spread = np.log(2 * math.pi * np.sqrt(np.maximum(np.linalg.det(rest), 1e-12)))
    worth = -0.5 * far - spread[:, :, None] - math.log(CLUTTER)
    worth[:, ~alike] = -np.inf
    worth[far > CHANCE] = -np.inf
    prior = -0.5 * distance[first, second]  # a pair far from where it is expected is less likely
    assignments = [_assigned(each) for each in worth]
    scores = np.array([score for _, score in assignments]) + prior
    best = int(np.argmax(scores))
    chosen = assignments[best][0]
    for (pairs, _), score in zip(assignments, scores, strict=True):
        if score > scores[best] - CLEAR:
            seen, seen_as = dict(pairs), {f: e for e, f in pairs}
            chosen = [(e, f) for e, f in chosen if seen.get(e, f) == f and seen_as.get(f, e) == e]
    return chosen


def _assigned(worth: np.ndarray) -> tuple[list[tuple[int, int]], float]:
    """The pairs of a table (k, f), the most likely first, each corner at most once, and their sum."""
    pairs, total, left = [], 0.0, worth.copy()
    while (best := left.max()) > 0:
        e, f = divmod(int(left.argmax()), left.shape[1])
        pairs.append((e, f))
        total += float(best)
        left[e], left[:, f] = -np.inf, -np.inf
    return pairs, total
