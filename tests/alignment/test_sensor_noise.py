"""A hover shows the noise of its sensors, whatever slow motion the vehicle makes."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from e2efly.alignment.sensor_noise import hover_of, measured_noise
from e2efly.control import Quat, Vec3
from e2efly.logs.recording import Record, Stream
from e2efly.vehicles.gravity import GRAVITY

SIGMA = {"position": 0.002, "velocity": 0.03, "attitude": 0.004, "body_rate": 0.05, "specific_force": 0.4}
GYRO_BIAS, FORCE_BIAS = np.array([0.02, -0.01, 0.03]), np.array([0.1, -0.2, 0.15])
RATES = {"body_rate": 500.0, "specific_force": 500.0, "position": 100.0, "velocity": 100.0, "quaternion": 100.0}


def hover(seconds: float = 10.0, begin: float = 0.0) -> Record:
    """A vehicle that drifts by centimetres and degrees within seconds, with noisy sensors."""
    rng, streams = np.random.default_rng(0), {}
    for name, rate in RATES.items():
        t = begin + np.arange(0, seconds, 1 / rate)
        phase = 2 * np.pi * 0.6 * t[:, None] + np.arange(3)
        angle = 0.03 * np.sin(phase)  # and the body rate is its derivative
        q = Quat.of(np.concatenate([np.ones((len(t), 1)), angle / 2], 1)).normalized()
        true = {
            "position": 0.05 * np.sin(phase), "velocity": 0.19 * np.cos(phase),
            "body_rate": 0.03 * 2 * np.pi * 0.6 * np.cos(phase) + GYRO_BIAS,
            "specific_force": q.unrotate(Vec3(0.0, 0.0, GRAVITY)).stack() + FORCE_BIAS,
        }  # fmt: skip
        if name == "quaternion":
            half = 0.5 * SIGMA["attitude"] * rng.standard_normal((len(t), 3))
            values = q.compose(Quat.of(np.concatenate([np.ones((len(t), 1)), half], 1))).normalized().stack()
        else:
            values = true[name] + SIGMA[name] * rng.standard_normal((len(t), 3))
        streams[name] = Stream(t, values)
    return Record(Path("hover.csv"), streams)


def test_noise_and_biases_of_every_sensor() -> None:
    found = {each.name: each for each in measured_noise(hover_of(hover()))}
    assert set(found) == set(SIGMA)
    for name, sigma in SIGMA.items():
        assert np.allclose(found[name].sigma, sigma, rtol=0.12), name
        assert abs(found[name].memory) < 0.2, name
    assert found["body_rate"].rate == pytest.approx(500)
    assert np.allclose(found["body_rate"].bias, GYRO_BIAS, atol=4e-3)
    assert np.allclose(found["specific_force"].bias, FORCE_BIAS, atol=0.03)
    assert found["position"].bias is None


def test_noise_of_a_filtered_gyroscope_has_a_memory() -> None:
    flight = hover()
    gyro = flight.streams["body_rate"]
    kernel = np.ones(8) / 8
    filtered = np.stack([np.convolve(x, kernel, "same") for x in gyro.values.T], -1)
    found = measured_noise(replace(flight, streams={"body_rate": Stream(gyro.time, filtered)}))
    assert found[0].memory > 0.7
    assert np.allclose(found[0].sigma, 0.05 / np.sqrt(8), rtol=0.2)


def test_only_the_calm_part_of_a_flight_is_judged() -> None:
    """A manoeuvre before it is left out; a log without a calm part is refused with what it needs."""
    flight = hover(12.0)
    gyro = flight.streams["body_rate"]
    lively = gyro.values + np.where(gyro.time[:, None] < 5, 3 * np.sin(2 * np.pi * gyro.time[:, None]), 0.0)
    wild = replace(flight, streams=flight.streams | {"body_rate": Stream(gyro.time, lively)})
    assert 4.5 < hover_of(wild).span[0] < 5.5
    with pytest.raises(ValueError, match=r"hover.csv: is calm for \d.\d s at a time .*accepted: 3 s of hover or more"):
        hover_of(wild.during(0.0, 6.0))
    with pytest.raises(ValueError, match="has position; accepted: a log with body_rate"):
        hover_of(replace(flight, streams={"position": flight.streams["position"]}))
