"""What samples must satisfy, and what is estimated from them."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from e2efly.flight.pose.conditions import REASONS, Checks
from e2efly.flight.pose.slope import follow_slope, slope, start_slope
from e2efly.flight.pose.tracking import PoseTrack, age, rotation_between, track
from e2efly.policy.odometry import Odometry, Sample

LEVEL = np.array([1.0, 0, 0, 0])
T = 0.01


def sample(time: float, x: float = 0.0, **changes: object) -> Sample:
    """A sample of a vehicle that hovers near the origin, with a little noise that tells it from a frozen one."""
    position = np.array([x, 0.0, 1.0 + 1e-6 * math.sin(1e5 * time)])
    return replace(Sample(received=50 + time, stamp=time, position=position, quaternion=LEVEL), **changes)  # type: ignore


def fly(checks: Checks, samples: list[Sample], start: PoseTrack | None = None) -> tuple[PoseTrack, list[tuple]]:
    state, out = start or PoseTrack(), []
    for one in samples:
        state, odometry, reason = track(checks, state, one)
        assert odometry is None or reason is None
        assert reason is None or reason.partition(":")[0] in REASONS
        out.append((odometry, reason))
    return state, out


def hovering(duration: float = 0.5, checks: Checks | None = None) -> PoseTrack:
    state, out = fly(checks or Checks(), [sample(k * T) for k in range(round(duration / T))])
    assert out[-1][0] is not None
    return state


def turned(angle: float, axis: int = 2) -> np.ndarray:
    q = np.array([math.cos(angle / 2), 0, 0, 0])
    q[1 + axis] = math.sin(angle / 2)
    return q


REFUSALS = {
    "malformed": (sample(0.5, position=np.zeros(2)), "position is array"),
    "not_finite": (sample(0.5, position=np.array([0, np.nan, 0])), r"position is \[0.0, nan, 0.0\]"),
    "not_finite body rate": (sample(0.5, body_rate=np.array([0, 0, np.inf])), "body_rate is"),
    "not_finite stamp": (sample(0.5, stamp=math.nan), "stamp is nan"),
    "quaternion": (sample(0.5, quaternion=np.array([1.05, 0, 0, 0])), "its length is 1.05; accepted: 1 within 0.01"),
    "quaternion zero": (sample(0.5, quaternion=np.zeros(4)), "its length is 0;"),
    "frame": (sample(0.5, frame="odom"), "frame is 'odom'; accepted: 'map'"),
    "frame missing": (sample(0.5, frame=""), "frame is ''; accepted: 'map'"),
    "order": (sample(0.485), "its stamp is 0.005 s before the last"),
    "order same": (sample(0.49), "its stamp is 0 s before the last; accepted: later"),
    "late": (sample(0.5, received=50.8), "0.3 s later than the quickest; accepted: at most 0.1 s"),
    "speed": (sample(0.5, velocity=np.array([0, -16.0, 0])), "velocity is .* at most 15 per axis"),
    "velocity": (sample(0.5, velocity=np.array([3.0, 0, 0])), "3 from how the position changes"),
    "jump": (sample(0.5, x=1.0), "by 1 m and 0 rad within 0.01 s; accepted: at most 0.2 m and 0.55 rad"),
    "jump attitude": (sample(0.5, quaternion=turned(1.0)), "by .* m and 1 rad"),
}


@pytest.mark.parametrize("name", REFUSALS)
def test_a_bad_sample_is_refused_by_name_and_the_next_good_one_passes(name: str) -> None:
    bad, text = REFUSALS[name]
    checks = Checks(frame="map")
    framed = [replace(sample(k * T), frame="map") for k in range(50)]
    state, _ = fly(checks, framed)
    bad = bad if name.startswith("frame") else replace(bad, frame="map")
    after, odometry, reason = track(checks, state, bad)
    assert odometry is None
    assert reason.startswith(name.split()[0] + ": ")
    assert re.search(text, reason)
    assert after.odometry is state.odometry
    assert age(after, 50.6) == pytest.approx(0.11)  # the age goes on from the last good one
    _, out = fly(checks, [replace(sample(0.51), frame="map")], after)
    assert out[0][0] is not None


@given(st.floats(allow_nan=True), st.integers(0, 12), st.floats(-1, 1))
@settings(max_examples=150, deadline=None)
def test_whatever_comes_in_what_comes_out_is_finite_and_unit(value: float, place: int, dt: float) -> None:
    state = hovering(0.3)
    numbers = np.array([0, 0, 1, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0.3 + dt], float)
    numbers[place] = value
    p, q, v, w, stamp = numbers[:3], numbers[3:7], numbers[7:10], numbers[10:12], numbers[12]
    one = Sample(50.3 + dt, p, q, float(stamp), v, np.array([*w, 0.0]))
    after, out = fly(Checks(), [one, sample(0.3 + dt + T)], state)
    for odometry, _ in out:
        if odometry is not None:
            for array in (odometry.position, odometry.velocity, odometry.quaternion, odometry.body_rate):
                assert np.isfinite(array).all()
            assert np.linalg.norm(odometry.quaternion) == pytest.approx(1, abs=1e-12)
            assert odometry.time <= 50.3 + dt + T + 1e-9
    assert isinstance(after, PoseTrack)


def test_a_lasting_jump_stays_a_fault_until_the_track_starts_anew() -> None:
    state = hovering()
    state, out = fly(Checks(), [sample(0.5 + k * T, x=1.0) for k in range(300)], state)
    assert all(odometry is None for odometry, _ in out)
    assert "a fault until the track starts anew" in out[-1][1]
    state, out = fly(Checks(), [sample(3.5 + k * T) for k in range(20)], state)  # back where it was: no matter
    assert all(odometry is None and reason.startswith("jump") for odometry, reason in out)
    _, out = fly(Checks(), [sample(4 + k * T) for k in range(20)])
    assert out[-1][0] is not None


@pytest.mark.parametrize("step", [0.25, 0.5, 2.0])
def test_a_lasting_jump_of_any_size_never_passes(step: float) -> None:
    state = hovering()
    _, out = fly(Checks(), [sample(0.5 + k * T, x=step) for k in range(300)], state)
    assert all(odometry is None for odometry, _ in out)


def test_outliers_pass_by() -> None:
    state = hovering()
    samples = [sample(0.5 + k * T, x=5.0 if k % 7 == 3 else 0.0) for k in range(70)]
    _, out = fly(Checks(), samples, state)
    assert [reason is None for _, reason in out] == [k % 7 != 3 for k in range(70)]


def spinning(time: float, rate: float = 25.0) -> Sample:
    """A vehicle that flies at 8 m/s and turns fast about its z axis."""
    return sample(time, x=8 * time, quaternion=turned(rate * time), velocity=np.array([8.0, 0, 0]),
                  body_rate=np.array([0, 0, rate]))  # fmt: skip


@pytest.mark.parametrize("ahead", [0.4, 0.6, 1.5, 3.0, -0.9, -1.5])
def test_the_true_pose_after_an_outlier_passes_however_fast_the_vehicle_turns(ahead: float) -> None:
    """An outlier on the side that the vehicle turns to is nearer to the next true pose than the last good one is."""
    state, _ = fly(Checks(), [spinning(k * T) for k in range(50)])
    outlier = replace(spinning(0.5), quaternion=turned(25 * 0.5 + ahead))
    _, out = fly(Checks(), [outlier, *(spinning(0.51 + k * T) for k in range(20))], state)
    assert out[0][1].startswith("jump: by")
    assert [reason for _, reason in out[1:]] == [None] * 20


@pytest.mark.parametrize("ahead", [0.4, 1.5, -0.9])
def test_a_lasting_turn_of_the_pose_never_passes_however_fast_the_vehicle_turns(ahead: float) -> None:
    state, _ = fly(Checks(), [spinning(k * T) for k in range(50)])
    lasting = [replace(spinning(0.5 + k * T), quaternion=turned(25 * (0.5 + k * T) + ahead)) for k in range(100)]
    _, out = fly(Checks(), lasting, state)
    assert all(odometry is None for odometry, _ in out)
    assert "a fault until" in out[-1][1]


@pytest.mark.parametrize("seed", range(20))
def test_no_jump_is_refused_that_its_own_text_accepts(seed: int) -> None:
    """Outliers of all sizes among fast motion: what is refused by its size is beyond what the text accepts."""
    random, state, said = np.random.default_rng(seed), PoseTrack(), []
    for k in range(300):
        one = spinning(k * 0.007)
        if random.random() < 0.3:
            off, angle = random.uniform(-0.4, 0.4, 3), random.uniform(-1.5, 1.5)
            one = replace(one, position=one.position + off, quaternion=turned(25 * k * 0.007 + angle))
        state, _, reason = track(Checks(jump_count=1000), state, one)
        said.append(reason or "")
    by = [re.match(r"jump: by (\S+) m and (\S+) rad within .* at most (\S+) m and (\S+) rad", text) for text in said]
    numbers = [tuple(map(float, match.groups())) for match in by if match]
    assert len(numbers) > 20
    assert all(step >= reach or angle >= turn for step, angle, reach, turn in numbers)
    near = [re.match(r"jump: (\S+) m and (\S+) rad from .* now (\S+) m and (\S+) rad away", text) for text in said]
    assert all(match for match, text in zip(near, said, strict=True) if text.startswith("jump") and "by" not in text)


def test_flight_at_the_limits_of_the_vehicle_is_no_jump() -> None:
    s = np.arange(0, 4, T)
    x, angle = 3 * np.sin(14 / 3 * s), 25 * s  # up to 14 m/s and 65 m/s^2; 25 rad/s
    samples = [sample(t, x=a, quaternion=turned(b)) for t, a, b in zip(s.tolist(), x, angle, strict=True)]
    _, out = fly(Checks(), samples)
    assert all(reason is None or reason.startswith("starting") for _, reason in out)


def test_a_frozen_pose_is_refused_until_it_moves() -> None:
    state = hovering()
    still = sample(0.5)
    frozen = [replace(still, stamp=0.5 + k * T, received=50.5 + k * T) for k in range(40)]
    state, out = fly(Checks(frozen_after=0.205), frozen, state)
    assert [reason is None for _, reason in out] == [k <= 20 for k in range(40)]
    assert out[-1][1].startswith("frozen: the same pose for 0.39 s; accepted: at most 0.205 s")
    _, out = fly(Checks(), [sample(0.9)], state)
    assert out[0][1] is None
    _, out = fly(Checks(frozen_after=math.inf), frozen, hovering())
    assert all(reason is None for _, reason in out)


def test_samples_out_of_order_can_be_ignored() -> None:
    state, odometry, reason = track(Checks(out_of_order="ignore"), hovering(), sample(0.485))
    assert (odometry, reason) == (None, None)
    assert age(state, 50.5) == pytest.approx(0.01)


def test_before_the_first_odometry_the_age_is_infinite() -> None:
    assert age(PoseTrack(), 5.0) == math.inf
    state, out = fly(Checks(), [sample(0), sample(T)])
    assert out[0][1].startswith("starting: 1 samples in 0 s are too few for velocity")
    assert age(state, 60) == math.inf


def test_a_quaternion_is_normalised_within_the_tolerance() -> None:
    _, out = fly(Checks(), [sample(k * T, quaternion=1.009 * LEVEL) for k in range(20)])
    np.testing.assert_array_equal(out[-1][0].quaternion, LEVEL)


def test_a_source_that_gives_everything_is_used_from_its_first_sample() -> None:
    full = sample(0, velocity=np.array([0.1, 0, 0]), body_rate=np.array([0, 0.2, 0]))
    _, odometry, reason = track(Checks(), PoseTrack(), full)
    assert reason is None
    np.testing.assert_array_equal(odometry.velocity, [0.1, 0, 0])
    np.testing.assert_array_equal(odometry.body_rate, [0, 0.2, 0])


# Time


@pytest.mark.parametrize("drift", [-5e-5, 5e-5, 1e-4])
def test_jitter_of_the_way_is_taken_out_of_the_times(drift: float) -> None:
    """For two minutes, with clocks that drift apart as two ordinary crystals do."""
    rng = np.random.default_rng(0)
    n, interval = 3000, 0.04
    delays = 0.002 + rng.exponential(0.004, n)
    true = 1000 + np.arange(n) * interval * (1 + drift)
    state, error = PoseTrack(), []
    for k in range(n):
        one = sample(k * interval, received=float(true[k] + delays[k]))
        state, odometry, _ = track(Checks(), state, one)
        if odometry is not None and k > 100:
            error.append(odometry.time - true[k] - 0.002)
    assert len(error) > 2800
    assert np.abs(error).max() < 1.5e-3
    assert np.std(error) < 0.1 * np.std(delays)


@given(st.lists(st.floats(0, 0.09), min_size=20, max_size=60), st.floats(-1e9, 1e9), st.floats(0, 0.05))
@settings(max_examples=100, deadline=None)
def test_no_sample_is_dated_after_its_arrival_or_too_far_before(delays: list[float], offset: float, lag: float) -> None:
    checks, state, last = Checks(latency=lag), PoseTrack(), -math.inf
    for k, delay in enumerate(delays):
        one = sample(k * T, stamp=k * T + offset, received=100 + k * T + delay)
        state, odometry, _ = track(checks, state, one)
        if odometry is not None:
            assert one.received - lag - 0.1 - 1e-6 <= odometry.time <= one.received - lag + 1e-6
            assert odometry.time > last
            last = odometry.time


@pytest.mark.parametrize("jump", [3600.0, 0.2, -0.2, -3600.0])
def test_a_jump_of_the_source_s_clock_is_reported_once(jump: float) -> None:
    jumped = [sample(0.5 + k * T, stamp=0.5 + k * T + jump) for k in range(50)]
    _, out = fly(Checks(), jumped, hovering())
    reason = out[0][1]
    assert reason.startswith("clock: the source's clock jumped by")
    assert math.copysign(1, jump) == (1 if "+" in reason.split(";")[0] else -1)
    assert all(reason is None for _, reason in out[1:])
    assert out[-1][0].time == pytest.approx(50.99, abs=1e-6)


def test_a_way_that_has_become_slow_stays_refused() -> None:
    _, out = fly(Checks(), [sample(0.5 + k * T, received=50.8 + k * T) for k in range(300)], hovering())
    assert all(reason is not None and reason.startswith("late") for _, reason in out)


def test_without_stamps_the_time_of_arrival_counts() -> None:
    samples = [sample(k * T, stamp=None) for k in range(20)]
    _, out = fly(Checks(latency=0.004), [*samples, samples[-1]])
    assert out[-2][0].time == pytest.approx(50.19 - 0.004)
    assert out[-1][1].startswith("order")


# Estimates


@given(st.lists(st.floats(1e-3, 0.1), min_size=3, max_size=50), st.floats(-10, 10), st.floats(1, 200))
@settings(max_examples=200, deadline=None)
def test_the_slope_of_a_line_is_exact_at_any_times(intervals: list[float], speed: float, rate: float) -> None:
    time, fit = 1e5, start_slope(1e5, np.array([speed * 0.0]))
    for interval in intervals:
        time += interval
        fit = follow_slope(fit, rate, time, np.array([speed * (time - 1e5)]))
    assert slope(fit)[0] == pytest.approx(speed, abs=1e-6)


def noise_gain(rate: float, interval: float) -> float:
    """What the module `slope` states of white noise."""
    b = math.exp(-rate * interval)
    return math.sqrt(2 * ((1 - b) / (1 + b)) ** 3) / interval


def test_the_noise_of_the_slope_is_as_stated() -> None:
    rng = np.random.default_rng(1)
    rate, n = 2 * math.pi * 15, 400
    fit = start_slope(0.0, rng.standard_normal(n))  # n fits at once
    slopes = []
    for k in range(1, 400):
        fit = follow_slope(fit, rate, k * T, rng.standard_normal(n))
        if k % 40 == 0:
            slopes.append(slope(fit))
    assert np.std(slopes) == pytest.approx(noise_gain(rate, T), rel=0.05)
    small = noise_gain(rate, 1e-4)
    assert small == pytest.approx(math.sqrt(rate**3 * 1e-4) / 2, rel=0.01)


def test_the_delay_of_the_slope_is_as_stated() -> None:
    rate, fit = 2 * math.pi * 15, start_slope(0.0, np.zeros(1))
    for k in range(1, 3000):
        fit = follow_slope(fit, rate, k * 1e-3, np.array([0.5 * (k * 1e-3) ** 2]))
    assert 2.999 - slope(fit)[0] == pytest.approx(2 / rate, rel=0.05)  # 1 m/s^2


def test_velocity_and_body_rate_of_a_circle_flown_with_noise() -> None:
    """2 m/s on a circle of 1 m, nose ahead, irregular samples: the errors are the stated delay and the stated noise."""
    rng = np.random.default_rng(2)
    times = np.cumsum(rng.uniform(0.006, 0.014, 3000))
    state, errors, rates = PoseTrack(), [], []
    checks = Checks()
    for t in times.tolist():
        position = np.array([math.cos(2 * t), math.sin(2 * t), 1]) + 1e-3 * rng.standard_normal(3)
        noise = np.array([1, *(0.5e-3 * rng.standard_normal(3))])
        quaternion = product(turned(2 * t + math.pi / 2), noise / np.linalg.norm(noise))
        state, odometry, _ = track(checks, state, Sample(7 + t, position, quaternion, t))
        if odometry is not None and t > 1:
            late = t - 1 / (math.pi * checks.velocity_cutoff)
            errors.append(odometry.velocity - [-2 * math.sin(2 * late), 2 * math.cos(2 * late), 0])
            rates.append(odometry.body_rate - [0, 0, 2])
    assert len(errors) > 2800
    assert np.abs(np.mean(errors, 0)).max() < 0.01
    assert np.std(errors) == pytest.approx(1e-3 * noise_gain(2 * math.pi * 15, 0.01), rel=0.15)
    assert np.abs(np.mean(rates, 0)).max() < 0.01
    assert np.std(rates) == pytest.approx(1e-3 * noise_gain(2 * math.pi * 30, 0.01), rel=0.15)


def test_a_body_rate_is_about_the_body_s_axes() -> None:
    """Tilted a quarter turn about body y, then rolling about body x, which is world -z."""
    state, checks = PoseTrack(), Checks(frozen_after=math.inf)
    odometry: Odometry | None = None
    for k in range(50):
        quaternion = product(turned(math.pi / 2, axis=1), turned(1.5 * k * T, axis=0))
        state, odometry, _ = track(checks, state, sample(k * T, quaternion=quaternion))
    np.testing.assert_allclose(odometry.body_rate, [1.5, 0, 0], atol=1e-9)


def test_the_quaternion_is_continuous_though_the_source_flips_its_sign() -> None:
    state, checks, last = PoseTrack(), Checks(), None
    for k in range(700):  # more than two turns
        q = turned(2 * k * T)
        state, odometry, reason = track(checks, state, sample(k * T, quaternion=q if k % 3 else -q))
        if odometry is not None:
            if last is not None:
                assert np.linalg.norm(odometry.quaternion - last) < 0.02
                np.testing.assert_allclose(odometry.body_rate, [0, 0, 2], atol=1e-9)
            last = odometry.quaternion
        else:
            assert reason.startswith("starting")


@given(st.lists(st.floats(-1, 1), min_size=3, max_size=3))
def test_the_rotation_between_two_attitudes_is_the_one_that_was_made(vector: list[float]) -> None:
    angle = float(np.linalg.norm(vector))
    turn = np.array([math.cos(angle / 2), *(np.sinc(angle / 2 / math.pi) / 2 * np.array(vector))])
    start = np.array([0.5, -0.5, 0.5, 0.5])
    np.testing.assert_allclose(rotation_between(start, product(start, turn)), vector, atol=1e-9)
    np.testing.assert_allclose(rotation_between(start, -product(start, turn)), vector, atol=1e-9)


def product(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    w = a[0] * b[0] - a[1:] @ b[1:]
    return np.array([w, *(a[0] * b[1:] + b[0] * a[1:] + np.cross(a[1:], b[1:]))])


def test_after_a_pause_the_estimates_start_anew() -> None:
    state = hovering()
    _, out = fly(Checks(), [sample(1.2, x=2.0), sample(1.21, x=2.0), sample(1.22, x=2.0), sample(1.23, x=2.0)], state)
    assert out[0][1].startswith("starting")
    np.testing.assert_allclose(out[-1][0].velocity, 0, atol=1e-3)


def test_checks_that_make_no_sense_are_refused() -> None:
    with pytest.raises(ValueError, match=r"checks.max_age is 0.0; accepted: a number, 1e-09 to"):
        Checks(max_age=0.0)
    with pytest.raises(ValueError, match=r"checks.frame is None; accepted: a text"):
        Checks(frame=None)  # type: ignore[arg-type]
