"""Whether a source keeps the flight's time-out, judged before take-off."""

import numpy as np
import pytest

from e2efly.flight.pose.pace import WINDOW_S, Pace, pace_problem, paced

TIMEOUT = 0.1


def watched(times: np.ndarray, delay: float | np.ndarray = 0.01, pace: Pace | None = None) -> Pace:
    pace = pace or Pace()
    for time, late in zip(times.tolist(), np.broadcast_to(delay, times.shape).tolist(), strict=True):
        pace = paced(pace, time, time + late)
    return pace


def with_gaps(gap: float, every: float, seconds: float = 5.0) -> np.ndarray:
    times = np.arange(0, seconds, 0.005)
    return times[times % every >= gap]


@pytest.mark.parametrize("rate", [20.0, 100.0, 1000.0])
def test_a_steady_source_is_accepted_and_its_rate_is_told(rate: float) -> None:
    pace = watched(np.arange(0, 8, 1 / rate))
    assert pace.rate == pytest.approx(rate, rel=0.02)
    assert pace.oldest == pytest.approx(1 / rate + 0.01)
    assert pace_problem(pace, TIMEOUT) is None


def test_poses_at_5_hz_are_refused_with_their_figures() -> None:
    pace = watched(np.arange(0, 4, 0.2))
    assert pace_problem(pace, TIMEOUT) == (
        "poses come at 5 Hz, and the newest was up to 0.21 s old within the last 3 s; accepted: 0.075 s, "
        "0.75 of odometry_timeout"
    )
    assert pace_problem(pace, 0.6) is None


@pytest.mark.parametrize("end", np.arange(0.7, 5.0, 0.11).tolist())
def test_gaps_of_120_ms_twice_a_second_are_refused_at_every_moment(end: float) -> None:
    assert "poses come at" in (pace_problem(watched(with_gaps(0.12, 0.5, end)), TIMEOUT) or "")


def test_late_arrivals_count_as_gaps_do() -> None:
    times = np.arange(0, 3, 0.01)
    assert pace_problem(watched(times, 0.06), TIMEOUT) is None
    assert pace_problem(watched(times, 0.08), TIMEOUT) is not None


def test_a_gap_is_forgotten_after_the_window() -> None:
    pace = watched(np.arange(0, 1, 0.01))
    pace = watched(np.arange(2, 2 + WINDOW_S / 2 - 0.02, 0.01), pace=pace)
    assert pace_problem(pace, TIMEOUT) is not None
    pace = watched(np.arange(pace.time or 0.0, 2 + 2 * WINDOW_S, 0.01)[1:], pace=pace)
    assert pace_problem(pace, TIMEOUT) is None
    assert pace.rate == pytest.approx(100, rel=0.02)


def test_before_the_first_pose_nothing_is_said() -> None:
    assert pace_problem(Pace(), TIMEOUT) is None
    assert pace_problem(watched(np.array([1.0])), TIMEOUT) is None
