"""How late a source's own velocity and body rate are, on synthetic motion that is filtered by SciPy."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pytest
from scipy.signal import lfilter

from e2efly.flight.pilot.lag_watch import LONGEST_STEP, LagWatch, MeasuredLag, lags_of, moved
from e2efly.flight.pose.conditions import Checks
from e2efly.flight.pose.tracking import PoseTrack, track
from e2efly.policy.odometry import Odometry, Sample
from tests.flight.test_delay_watch import quaternions

STEP = 1e-3
"""Of the true motion, s."""
LEVEL = np.array([1.0, 0.0, 0.0, 0.0])


@dataclass(frozen=True)
class Kind:
    """Three sinusoids along and about each axis, or a climb."""

    size: float = 0.1
    """Of each at most, m."""
    turn: float = 0.15
    """Of each at most, rad."""
    lowest: float = 0.3
    highest: float = 1.2
    """Hz."""
    climb: float = 0.0
    """m/s, from half a second on."""
    noise: float = 0.03
    """Of the velocity, m/s."""


KINDS = {
    "carried and turned by hand": Kind(0.15, 0.25),
    "shaken by hand": Kind(0.08, 0.12, 0.5, 2.0),
    "a race": Kind(1.2, 0.6, 0.3, 1.0),
    "a take-off": Kind(0.02, 0.15, climb=0.4, noise=0.01),
}


@dataclass(frozen=True)
class Stream:
    """What a source sends: (n,) s, (n, 3) each."""

    time: np.ndarray
    position: np.ndarray
    velocity: np.ndarray
    angle: np.ndarray
    body_rate: np.ndarray


def low_pass(x: np.ndarray, lag: float) -> np.ndarray:
    """A first-order low-pass at rest in its first value."""
    kept = np.exp(-STEP / lag) if lag else 0.0
    return x[0] + lfilter([1 - kept], [1, -kept], x - x[0], axis=0)


def later(x: np.ndarray, lag: float) -> np.ndarray:
    """A delay."""
    steps = round(lag / STEP)
    return np.concatenate([np.repeat(x[:1], steps, axis=0), x])[: len(x)]


def stream(kind: Kind, seed: int, lag: float, *, filter=low_pass, rate: float = 100.0, seconds: float = 4.0) -> Stream:  # noqa: ANN001
    """A source with noise, at irregular times. Its velocity and body rate are `lag` s late."""
    random = np.random.default_rng(seed)
    t = np.arange(-1.0, seconds, STEP)
    frequency, phase = random.uniform(kind.lowest, kind.highest, (3, 3)), random.uniform(0, 2 * np.pi, (2, 3, 3))
    sizes = random.uniform(0.3, 1.0, (2, 3, 3)) * np.array([kind.size, kind.turn])[:, None, None]
    waves = (2 * np.pi * frequency[..., None] * t + phase[..., None] for phase in phase)
    place, angle = ((size[..., None] * np.sin(wave)).sum(1).T for size, wave in zip(sizes, waves, strict=True))
    place[:, 2] += kind.climb * np.logaddexp(0.0, (t - 0.5) / 0.1) * 0.1
    velocity, turning = (filter(np.gradient(x, STEP, axis=0), lag) for x in (place, angle))
    every = np.cumsum(random.uniform(0.7, 1.3, int(seconds * rate)) / rate)
    at = np.searchsorted(t, every[every < seconds - 0.01])
    noisy = [
        x[at] + sigma * random.standard_normal((len(at), 3))
        for x, sigma in ((place, 1e-3), (velocity, kind.noise), (angle, 1e-3), (turning, 0.05))
    ]
    return Stream(t[at], *noisy)


def odometries(of: Stream) -> Iterator[tuple[Odometry, np.ndarray]]:
    for time, position, velocity, angle, rate in zip(*vars(of).values(), strict=True):
        yield Odometry(float(time), position, velocity, LEVEL, rate), angle


def watched(of: Stream, watch: LagWatch | None = None) -> LagWatch:
    watch = watch or LagWatch()
    for odometry, angle in odometries(of):
        watch = moved(watch, odometry, angle)
    return watch


def off(found: MeasuredLag | None, lag: float) -> float:
    assert found is not None
    assert abs(found.seconds - lag) <= 3 * found.deviation + 2e-3
    return abs(found.seconds - lag)


@pytest.mark.parametrize("lag", [0.0, 0.01, 0.02, 0.04, 0.06, 0.08])
@pytest.mark.parametrize("name", KINDS)
def test_a_low_pass_is_measured_within_4_ms(name: str, lag: float) -> None:
    seconds = 2.5 if KINDS[name].climb else 4.0
    for seed in range(4):
        velocity, body_rate = lags_of(watched(stream(KINDS[name], seed, lag, seconds=seconds)))
        assert off(velocity, lag) < 4e-3 and off(body_rate, lag) < 4e-3


@pytest.mark.parametrize("name", ["carried and turned by hand", "a race"])
def test_a_delay_is_measured_as_a_low_pass_is(name: str) -> None:
    for seed in range(4):
        velocity, body_rate = lags_of(watched(stream(KINDS[name], seed, 0.05, filter=later)))
        assert off(velocity, 0.05) < 4e-3 and off(body_rate, 0.05) < 4e-3


def test_noise_of_the_velocity_makes_a_lag_no_shorter() -> None:
    """In a calm climb, noise that nobody subtracts would make it 12 ms shorter on average."""
    noisy = Kind(0.02, 0.15, climb=0.4, noise=0.03)
    found = [lags_of(watched(stream(noisy, seed, 0.08, seconds=2.5)))[0] for seed in range(12)]
    assert abs(np.mean([lag.seconds for lag in found if lag is not None]) - 0.08) < 4e-3
    assert sum(lag is not None for lag in found) > 8


def test_poses_at_30_hz_tell_it_too() -> None:
    for seed in range(4):
        velocity, _ = lags_of(watched(stream(KINDS["a race"], seed, 0.05, rate=30.0)))
        assert off(velocity, 0.05) < 4e-3


def test_of_200_clean_streams_none_seems_late() -> None:
    late = []
    for seed in range(200):
        of = stream(list(KINDS.values())[seed % len(KINDS)], 100 + seed, 0.0, seconds=2.0 + 0.02 * seed)
        late += [lag.seconds - 2 * lag.deviation for lag in lags_of(watched(of)) if lag is not None]
    assert len(late) > 350 and max(late) < 4e-3


def test_what_the_bridge_estimates_from_poses_is_measured_as_its_filter_is_late() -> None:
    """Samples every T with weights that fade by b: T (1 + 3 b) / 2 (1 - b), from the moments of the weights."""
    checks, known, watch = Checks(), PoseTrack(), LagWatch()
    of = stream(KINDS["a race"], 0, 0.0)
    for time, place, attitude in zip(of.time.tolist(), of.position, quaternions(of.angle), strict=True):
        known, odometry, _ = track(checks, known, Sample(time, place, attitude))
        if odometry is not None:
            watch = moved(watch, odometry, known.angle)
    filters = (checks.velocity_cutoff, checks.velocity_lag), (checks.rate_cutoff, checks.rate_lag)
    for found, (cutoff, told) in zip(lags_of(watch), filters, strict=True):
        b = np.exp(-2 * np.pi * cutoff * 0.01)
        late = 0.01 * (1 + 3 * b) / (2 * (1 - b))
        assert off(found, late) < 2e-3 and late < told


@pytest.mark.parametrize("kind", [Kind(0.0, 0.0), Kind(5e-3, 5e-3), Kind(0.02, 0.02, 0.1, 0.3)])
def test_too_little_motion_tells_nothing(kind: Kind) -> None:
    assert lags_of(watched(stream(kind, 0, 0.05))) == (None, None)


def test_half_a_second_of_motion_tells_nothing() -> None:
    assert lags_of(watched(stream(KINDS["a race"], 0, 0.05, seconds=0.7))) == (None, None)
    assert lags_of(LagWatch()) == (None, None)


@pytest.mark.parametrize("fault", ["scale", "bias", "pause", "jump"])
def test_what_else_is_wrong_is_not_taken_for_a_lag(fault: str) -> None:
    for seed in range(4):
        of = stream(KINDS["carried and turned by hand"], seed, 0.02)
        if fault == "scale":
            of = Stream(of.time, of.position, 0.93 * of.velocity, of.angle, of.body_rate)
        if fault == "bias":
            of = Stream(of.time, of.position, of.velocity + 0.1, of.angle, of.body_rate + 0.05)
        if fault == "pause":
            kept = (of.time < 1.5) | (of.time > 1.5 + 2 * LONGEST_STEP)
            of = Stream(*(x[kept] for x in vars(of).values()))
        if fault == "jump":
            of = Stream(of.time, of.position + 0.03 * (of.time > 2.0)[:, None], of.velocity, of.angle, of.body_rate)
        velocity, body_rate = lags_of(watched(of))
        assert velocity is None or abs(velocity.seconds - 0.02) < 4e-3
        assert off(body_rate, 0.02) < 4e-3


def test_a_source_that_becomes_better_is_measured_anew() -> None:
    kind = KINDS["carried and turned by hand"]
    watch = watched(stream(kind, 0, 0.08))
    good = stream(kind, 1, 0.0, seconds=12.0)
    velocity, _ = lags_of(watched(Stream(good.time + 10.0, *list(vars(good).values())[1:]), watch))
    assert off(velocity, 0.0) < 4e-3
