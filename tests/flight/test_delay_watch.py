"""How late the odometry is by the controller's gyro, on synthetic motion."""

from dataclasses import dataclass

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from e2efly.flight.pilot.delay_watch import DelayWatch, MeasuredDelay, delay_of, delay_problem, felt, turned
from e2efly.flight.pose.tracking import rotation_between
from e2efly.policy.odometry import Odometry

LENGTH_S = 3.5


@dataclass(frozen=True)
class Motion:
    """Three sinusoids about each axis."""

    size: float
    """Of each at most, rad."""
    lowest: float = 0.5
    highest: float = 1.5
    """Hz."""
    begins: float = 0.0
    """s; before, it stands."""
    axes: tuple[float, float, float] = (1.0, 1.0, 1.0)
    gyro_noise: float = 0.03
    """rad/s."""
    noise: float = 1e-3
    """Of the attitude, rad."""
    rate: float = 100.0
    """Of the attitudes, Hz."""


HAND = Motion(0.15)
MOTIONS = {
    "turned by hand, up to 0.4 rad": (HAND, 2e-3),
    "the same by poses at 30 Hz with 5 mrad of noise": (Motion(0.15, rate=30.0, noise=5e-3), 6e-3),
    "the same with 0.3 rad/s of vibration": (Motion(0.15, gyro_noise=0.3), 12e-3),
    "turned gently, up to 0.15 rad": (Motion(0.06, 0.3, 1.0), 10e-3),
    "the first 1.3 s of a flight, 0.03 rad": (Motion(0.012, 0.8, 3.0, 2.2, (1.0, 1.0, 0.2)), 12e-3),
}
"""Motions, and the error that is allowed, s."""


def quaternions(angles: np.ndarray) -> np.ndarray:
    """(n, 4) of (n, 3) roll, pitch and yaw."""
    return Rotation.from_euler("ZYX", angles[:, ::-1]).as_quat(scalar_first=True)


def watched(motion: Motion, delay: float, seed: int) -> DelayWatch:
    """The watch after `LENGTH_S`: a gyro at 50 Hz, dated within 5 ms, with a bias; attitudes that drift in yaw."""
    random = np.random.default_rng(seed)
    frequency = random.uniform(motion.lowest, motion.highest, (3, 3))
    size = motion.size * random.uniform(0.3, 1.0, (3, 3)) * np.array(motion.axes)[:, None]
    phase = random.uniform(0, 2 * np.pi, (3, 3))

    def angles(t: np.ndarray) -> np.ndarray:
        grown = np.clip((t - motion.begins) / 0.2, 0, 1)[:, None]
        return grown * (size * np.sin(2 * np.pi * frequency * t[:, None, None] + phase)).sum(-1)

    t, step = np.arange(0, LENGTH_S, 0.02), 1e-3
    pairs = zip(quaternions(angles(t - step)), quaternions(angles(t + step)), strict=True)
    rates = np.array([rotation_between(a, b) for a, b in pairs]) / (2 * step)
    rates += random.normal(0, 0.02, 3) + motion.gyro_noise * random.standard_normal(rates.shape)
    watch = DelayWatch()
    for time, rate in zip(t + random.uniform(-5e-3, 5e-3, len(t)), rates, strict=True):
        watch = felt(watch, float(time), tuple(rate.tolist()))
    t = np.arange(0.003, LENGTH_S, 1 / motion.rate)
    noisy = angles(t - delay) + motion.noise * random.standard_normal((len(t), 3)) + np.outer(t, [0, 0, 0.02])
    still = np.zeros(3)
    for time, quaternion in zip(t, quaternions(noisy), strict=True):
        watch = turned(watch, Odometry(float(time), still, still, quaternion, still))
    return watch


@pytest.mark.parametrize("name", MOTIONS)
def test_the_delay_is_told_as_well_as_stated(name: str) -> None:
    motion, allowed = MOTIONS[name]
    delays = np.linspace(0.0, 0.3, 8)
    told = [delay_of(watched(motion, delay, seed)) for seed, delay in enumerate(delays)]
    errors = [t.seconds - delay for t, delay in zip(told, delays, strict=True) if t is not None]
    assert len(errors) >= 6
    assert np.abs(errors).max() < allowed
    beyond = [abs(e) > 4 * t.deviation for e, t in zip(errors, filter(None, told), strict=True)]
    assert not any(beyond)


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize(
    "motion", [Motion(0.0), Motion(0.0, gyro_noise=0.3, noise=3e-3), Motion(0.001, axes=(1.0, 0.0, 0.0), noise=2e-3)]
)
def test_where_nothing_turns_nothing_is_told(motion: Motion, seed: int) -> None:
    assert delay_of(watched(motion, 0.1, seed)) is None


def test_a_periodic_motion_that_fits_two_delays_tells_nothing() -> None:
    assert delay_of(watched(Motion(0.2, 6.0, 6.0, axes=(1.0, 0.0, 0.0)), 0.1, 0)) is None


@pytest.mark.parametrize("seed", range(4))
def test_mirrored_axes_tell_nothing(seed: int) -> None:
    watch = watched(HAND, 0.1, seed)
    mirrored = tuple((time, rate * [1.0, -1.0, -1.0]) for time, rate in watch.rates)
    assert delay_of(DelayWatch(mirrored, watch.angles, watch.attitude)) is None


def test_a_gyro_of_another_scale_tells_the_same() -> None:
    watch = watched(HAND, 0.1, 0)
    doubled = DelayWatch(tuple((time, 2 * rate) for time, rate in watch.rates), watch.angles, watch.attitude)
    a, b = delay_of(watch), delay_of(doubled)
    assert b.seconds == pytest.approx(a.seconds, abs=1e-6)


def test_a_delay_beyond_what_is_looked_for_and_too_short_a_watch_tell_nothing() -> None:
    assert delay_of(DelayWatch()) is None
    assert delay_of(watched(HAND, 0.6, 0)) is None
    watch = watched(HAND, 0.1, 0)
    short = DelayWatch(watch.rates[-40:], watch.angles[-80:], watch.attitude)
    assert delay_of(short) is None


def test_old_motion_is_forgotten() -> None:
    watch = watched(HAND, 0.1, 0)
    odometry = Odometry(0.0, np.zeros(3), np.zeros(3), np.array([1.0, 0, 0, 0]), np.zeros(3))
    for k in range(500):
        watch = felt(watch, 10 + 0.02 * k, (0.0, 0.0, 0.0))
        watch = turned(watch, Odometry(10 + 0.01 * k, *(getattr(odometry, n) for n in
                       ("position", "velocity", "quaternion", "body_rate"))))  # fmt: skip
    assert min(watch.rates[0][0], watch.angles[0][0]) > 10
    assert max(len(watch.rates), len(watch.angles)) < 400


def test_a_delay_is_refused_in_words_only_where_it_is_surely_too_long() -> None:
    assert delay_problem(None, 0.05) is None
    assert delay_problem(MeasuredDelay(0.06, 0.01), 0.05) is None
    assert delay_problem(MeasuredDelay(0.15, 0.002), 0.05) == (
        "poses are 0.150 s late by the controller's gyro (within 0.004 s); accepted: 0.050 s; tell the source's delay "
        "by --latency, or mend it"
    )
