"""The analysis of a rate loop: spectra with a known vibration, the loop's terms, and logs that it refuses."""

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

from e2efly.commands.fly_report import FlyReport, run
from e2efly.logs.blackbox import Blackbox, read_blackbox
from e2efly.viewing.pid_analysis import THROTTLES, pid_analysis, pid_numbers
from e2efly.viewing.pid_plot import plot_pid

DATA = Path(__file__).parents[1] / "data" / "blackbox"
RATE, PEAK, SIZE = 1000.0, 180.0, 0.2
"""Sampling rate and frequency of a vibration, Hz, and its amplitude at full throttle, rad/s."""


def box(seconds: float = 12.0, motion: float = 2.0, rate: float = RATE) -> Blackbox:
    """Doublets on all axes, followed with a lag of 40 ms; a vibration that grows with the throttle, before a filter."""
    time = np.arange(0, seconds, 1 / rate)
    rng = np.random.default_rng(0)
    jumps = motion * rng.uniform(-1, 1, (int(seconds / 0.15) + 1, 3))
    setpoint = jumps[(time / 0.15).astype(int)]
    kept = np.exp(-1 / (rate * 0.04))
    clean = np.asarray(lfilter([1 - kept], [1, -kept], setpoint, axis=0))
    motor = np.repeat(0.33 + 0.5 * (time > seconds / 2)[:, None], 4, axis=1)
    shaken = SIZE * motor[:, :1] * np.sin(2 * np.pi * PEAK * time)[:, None]
    raw = clean + shaken + 0.002 * rng.standard_normal(clean.shape)
    terms = {"P": 0.05 * (setpoint - clean), "I": np.full_like(clean, 0.01)}
    return Blackbox(time, clean + 0.1 * (raw - clean), setpoint, motor, "test", 1, unfiltered=raw, terms=terms)


def test_a_vibration_shows_in_the_unfiltered_gyro_and_at_the_throttle_where_it_is(tmp_path: Path) -> None:
    found = pid_analysis(box(), "a.bbl")
    spectra = found.spectra
    assert spectra.unfiltered is not None
    assert spectra.peak(spectra.unfiltered) == pytest.approx(PEAK, abs=2.0)
    level = np.sqrt(0.5 * (0.33**2 + 0.83**2)) * SIZE / np.sqrt(2)
    assert spectra.noise(spectra.unfiltered) == pytest.approx(level, rel=0.15)
    assert spectra.noise(spectra.filtered) == pytest.approx(0.1 * level, rel=0.3)
    at = int(np.argmin(np.abs(spectra.frequency - PEAK)))
    low, high = (int(np.searchsorted(THROTTLES, t, side="right")) - 1 for t in (0.33, 0.83))
    assert spectra.by_throttle[0, high, at] == pytest.approx(0.83 / 0.33 * spectra.by_throttle[0, low, at], rel=0.2)
    assert found.responses["roll"].reason == "" and found.responses["roll"].rise == pytest.approx(0.04, abs=0.004)
    row = pid_numbers(found)["axes"]["roll"]  # type: ignore[index]
    assert row["terms_rms"]["I"] == pytest.approx(0.01) and set(row["terms_rms"]) == {"P", "I"}
    plot_pid(found, tmp_path / "pid.png", "a.bbl")
    assert (tmp_path / "pid.png").stat().st_size > 10_000


def test_logs_that_are_not_to_be_believed_are_refused_by_name() -> None:
    whole = box()
    torn = np.ones(len(whole.time), bool)
    torn[3000:4000] = False
    gappy = Blackbox(whole.time[torn], whole.gyro[torn], whole.setpoint[torn], whole.motor[torn], "test", 1)
    for bad, said in (
        (box(2.0), r"a\.bbl: lasts 2\.0 s; accepted for a PID analysis: 4 s"),
        (box(12.0, rate=125.0), r"a\.bbl: has 125 samples a second; .* 200 or more, set blackbox_sample_rate"),
        (gappy, r"a\.bbl: 8\.3 % of the time is in gaps, the longest of 1001 ms"),
    ):
        with pytest.raises(ValueError, match=said):
            pid_analysis(bad, "a.bbl")
    calm = pid_analysis(box(motion=0.05), "a.bbl")
    assert all("not enough excitation" in r.reason for r in calm.responses.values())
    mute = pid_analysis(dataclasses.replace(whole, setpoint=np.full_like(whole.setpoint, np.nan)), "a.bbl")
    assert all(r.reason for r in mute.responses.values())


class Logged:
    """In the place of the decoder's parser: a session with the fields of a tuning log."""

    names = (
        *("time", *(f"{name}[{i}]" for name in ("gyroADC", "setpoint", "axisP", "axisI", "axisD") for i in range(3))),
        *(f"motor[{i}]" for i in range(4)),
    )
    debug = 0

    def __init__(self, data: bytes, start: int, end: int) -> None:
        own = box()
        fine, motor = np.degrees(10 * own.gyro), 1000 + 1000 * own.motor
        terms = [1000 * own.terms["P"], 1000 * own.terms["I"], 0 * own.gyro]
        more = [np.degrees(10 * own.unfiltered)] if self.debug and own.unfiltered is not None else []
        self.main_field_names = [*self.names, *([f"debug[{i}]" for i in range(3)] if self.debug else [])]
        self.rows = np.column_stack([1e6 * own.time, fine, np.degrees(10 * own.setpoint), *terms, motor, *more])
        self.sys_config = {
            "frameIntervalPNum": 1, "frameIntervalPDenom": 8, "blackbox_high_resolution": 1, "debug_mode": self.debug,
            "motorOutput": (1000, 2000),
        }  # fmt: skip
        self.frame_defs, self.stream = {"I": {"count": len(self.main_field_names), "name": self.main_field_names}}, self
        self.pos, self.main_frames = 0, []

    def parse_header(self) -> None:
        """Nothing to do."""

    def read_char(self) -> str:
        """Never called."""
        return ""

    def parse_data(self) -> None:
        """All frames."""
        for row in self.rows:
            self.main_frames.append(row)


class LoggedDebug(Logged):
    """The same with the gyro before its filters in the debug fields, debug mode GYRO_SCALED."""

    debug = 6


@pytest.mark.parametrize("parser", [Logged, LoggedDebug])
def test_terms_and_the_unfiltered_gyro_are_read_on_request(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, parser: type[Logged]
) -> None:
    monkeypatch.setattr("betaflight_chirp_core.decoder.FlightLogParser", parser)
    monkeypatch.setattr("betaflight_chirp_core.decoder.split_sessions", lambda data: [(0, len(data))])
    file = tmp_path / "a.bbl"
    file.write_bytes(b"H Product:Blackbox")
    (session,), own = read_blackbox(file, tuning=True), box()
    assert set(session.terms) == {"P", "I", "D"}
    np.testing.assert_allclose(session.terms["P"], own.terms["P"], atol=1e-9)
    assert (session.unfiltered is not None) == (parser is LoggedDebug)
    if session.unfiltered is not None and own.unfiltered is not None:
        np.testing.assert_allclose(session.unfiltered, own.unfiltered, atol=1e-9)
    assert not read_blackbox(file)[0].terms  # nobody asked
    assert run(FlyReport(file, tmp_path / "out")) == 0
    (row,) = json.loads((tmp_path / "out" / "summary.json").read_text())["sessions"]
    assert row["axes"]["roll"]["terms_rms"]["I"] == pytest.approx(0.01)
    assert (tmp_path / "out" / "pid_1.png").is_file()


def test_a_blackbox_alone_takes_no_option_of_a_flight_log(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"--bag1 is .*; accepted: with a flight log"):
        run(FlyReport(DATA / "sitl.bfl", tmp_path, bag1=tmp_path / "a.bag"))
