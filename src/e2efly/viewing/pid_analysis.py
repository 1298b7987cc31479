"""The analysis of a rate loop from a log: step responses, spectra of the gyroscope, and the terms P, I, D and F.

The idea of judging a tune by these pictures is that of the tools of pilots (PID-Analyzer by Florian Melsheimer,
PIDtoolbox by Brian White). The spectra are Welch's (P. D. Welch, "The use of fast Fourier transform for the estimation
of power spectra", 1967), the step responses those of `rate_response`.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from scipy.signal import spectrogram, welch

from e2efly.logs.blackbox import Blackbox
from e2efly.logs.flight_log import FlightLog
from e2efly.viewing.flight_data import AXES, blackbox_responses, gyro, response_numbers
from e2efly.viewing.rate_response import StepResponse

LEAST_S, LEAST_HZ = 4.0, 200.0
"""Shortest log, s, and lowest sampling rate, Hz, of which spectra are made. Motors and frames vibrate above 100 Hz."""
LOST = 0.02
"""Largest share of the time that may be in gaps."""
PIECE_S = 0.5
"""Length of the pieces of which spectra are averages, s."""
THROTTLES = np.linspace(0.0, 1.0, 21)
"""Edges of the classes of throttle for which spectra are averaged."""
NOISE_HZ = 80.0
"""Frequency above which the body's rate is taken to be noise, Hz."""


@dataclass(frozen=True)
class GyroSpectra:
    """Amplitude spectral densities of the gyroscope, rad/s per root of Hz."""

    frequency: np.ndarray
    """(k,) Hz."""
    filtered: np.ndarray
    """(3, k) of the gyro that the rate loop uses."""
    unfiltered: np.ndarray | None
    """(3, k) of the gyro before its filters. None: it was not logged."""
    by_throttle: np.ndarray
    """(3, len(THROTTLES) - 1, k) the same by the mean motor output, of the unfiltered gyro if it was logged. NaN where
    the throttle never was. Without motor outputs, NaN everywhere."""

    def noise(self, which: np.ndarray) -> np.ndarray:
        """Root mean square above `NOISE_HZ`, rad/s, (3,), of `filtered` or `unfiltered`."""
        above = self.frequency >= NOISE_HZ
        return np.sqrt(np.sum(which[:, above] ** 2, axis=1) * (self.frequency[1] - self.frequency[0]))

    def peak(self, which: np.ndarray) -> np.ndarray:
        """The frequency with the highest density above `NOISE_HZ`, Hz, (3,)."""
        above = self.frequency >= NOISE_HZ
        return self.frequency[above][np.argmax(which[:, above], axis=1)]


@dataclass(frozen=True)
class PidAnalysis:
    """What a log says about its rate loop."""

    time: np.ndarray
    """(n,) s."""
    rate: float
    """Sampling rate, Hz."""
    setpoint: np.ndarray
    """(n, 3) rad/s. NaN: not logged."""
    gyro: np.ndarray
    """(n, 3) rad/s."""
    responses: dict[str, StepResponse]
    """The step response of each axis, or why it is not to be believed."""
    spectra: GyroSpectra
    terms: Mapping[str, np.ndarray] = field(default_factory=dict)
    """By term, (n, 3) share of the mixer's full range. Terms that were not logged are missing."""
    firmware: str = ""


def pid_analysis(box: Blackbox, of: str) -> PidAnalysis:
    """Analyse the rate loop of one session of a blackbox log, read with `tuning`. `of` names the log in errors.

    Raises:
        ValueError: for a log that is too short, too slow, or has gaps, naming it and what is accepted.
    """
    time, rate = box.time, 1 / float(np.median(np.diff(box.time))) if len(box.time) > 1 else 0.0
    if len(time) < 2 or np.ptp(time) < LEAST_S:
        length = float(np.ptp(time)) if len(time) else 0.0
        raise ValueError(f"{of}: lasts {length:.1f} s; accepted for a PID analysis: {LEAST_S:g} s or more")
    if rate < LEAST_HZ:
        raise ValueError(
            f"{of}: has {rate:.0f} samples a second; accepted for a PID analysis: {LEAST_HZ:g} or more, "
            "set blackbox_sample_rate=1/4"
        )
    pauses = np.diff(time)
    lost = float(pauses[pauses > 1.5 / rate].sum() - (pauses > 1.5 / rate).sum() / rate) / float(np.ptp(time))
    if lost > LOST:
        raise ValueError(
            f"{of}: {100 * lost:.1f} % of the time is in gaps, the longest of {1e3 * pauses.max():.0f} ms; accepted "
            f"for a PID analysis: up to {100 * LOST:g} %, as on a faster card, or with a lower blackbox_sample_rate"
        )
    even = np.arange(time[0], time[-1], 1 / rate)  # a lost frame must not move what comes after it

    def evenly(values: np.ndarray) -> np.ndarray:
        return np.stack([np.interp(even, time, column) for column in values.T])

    gyro, raw = evenly(box.gyro), None if box.unfiltered is None else evenly(box.unfiltered)
    size = round(PIECE_S * rate)
    frequency, filtered = welch(gyro, rate, nperseg=size)
    unfiltered = None if raw is None else np.sqrt(welch(raw, rate, nperseg=size)[1])
    throttle = np.interp(even, time, box.motor.mean(axis=1))
    spectra = GyroSpectra(
        frequency, np.sqrt(filtered), unfiltered, _by_throttle(gyro if raw is None else raw, throttle, rate, size)
    )
    found = blackbox_responses(box)
    return PidAnalysis(time, rate, box.setpoint, box.gyro, found, spectra, box.terms, box.firmware)


def analysis_of(log: FlightLog, box: Blackbox | None) -> PidAnalysis | str:
    """The analysis of a flight, from its blackbox, or the reason why there is none."""
    if box is None:
        time, _, _ = gyro(log)
        rate = 1 / float(np.median(np.diff(time))) if len(time) > 1 else 0.0
        return f"{log.path}: has {rate:.0f} samples of the gyro a second; accepted for a PID analysis: --blackbox FILE"
    try:
        return pid_analysis(box, f"blackbox of {log.path}")
    except ValueError as error:
        return str(error)


def _by_throttle(gyro: np.ndarray, throttle: np.ndarray, rate: float, size: int) -> np.ndarray:
    """Mean densities of pieces whose mean throttle is in the same class."""
    _, middle, power = spectrogram(gyro, rate, nperseg=size, noverlap=size // 2)
    mean = np.array([throttle[round(t * rate - size / 2) :][:size].mean() for t in middle])
    out = np.full((3, len(THROTTLES) - 1, power.shape[1]), np.nan)
    for k in range(len(THROTTLES) - 1):
        own = (mean >= THROTTLES[k]) & (mean < THROTTLES[k + 1])
        if own.any():
            out[:, k] = np.sqrt(power[:, :, own].mean(axis=2))
    return out


def pid_numbers(found: PidAnalysis) -> dict[str, object]:
    """The analysis in numbers, by axis, SI units. It can be written as JSON once NaN is replaced."""
    spectra, rows = found.spectra, {}
    for i, axis in enumerate(AXES):
        row: dict[str, object] = {
            "step_response": response_numbers(found.responses[axis]),
            "noise_rad_s": float(spectra.noise(spectra.filtered)[i]),
            "unfiltered_noise_rad_s": None,
            "noise_peak_hz": float(spectra.peak(spectra.filtered)[i]),
            "terms_rms": {name: float(np.sqrt(np.mean(x[:, i] ** 2))) for name, x in found.terms.items()},
        }
        if spectra.unfiltered is not None:
            row["unfiltered_noise_rad_s"] = float(spectra.noise(spectra.unfiltered)[i])
            row["noise_peak_hz"] = float(spectra.peak(spectra.unfiltered)[i])
        rows[axis] = row
    return {"firmware": found.firmware, "rate_hz": found.rate, "axes": rows}
