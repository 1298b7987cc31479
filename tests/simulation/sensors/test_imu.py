"""The IMU against the statistics that its data sheet promises."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from docs.noise_plots import allan_deviation

from e2efly.config import ImuConfig
from e2efly.environment import random_key
from e2efly.simulation.physics import State, rotation
from e2efly.simulation.sensors import imu
from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.loading import load_vehicle

DT = 1 / 30
SILENT = ImuConfig(gyro_noise=0.0, gyro_bias=0.0, accel_noise=0.0, accel_bias=0.0)


def resting(n: int) -> State:
    return State.hovering(load_vehicle("vis_r"), jnp.zeros((n, 3)))


def test_at_rest_it_measures_gravity_up() -> None:
    rest = resting(2)
    reading = imu.measure(SILENT, random_key(0), imu.ImuState.at(rest), rest, rest, DT)
    for measured in (reading, imu.ImuState.at(rest)):
        np.testing.assert_allclose(measured.accelerometer, [[0, 0, 9.81]] * 2, rtol=1e-6)
        np.testing.assert_array_equal(measured.gyroscope, np.zeros((2, 3)))


def test_specific_force_in_the_body_frame() -> None:
    """On its right side: gravity along +y (left is up). Falling: nothing. Pushed forward by 2 m/s^2: +x."""
    rest = resting(1)
    side = rotation.from_euler(jnp.asarray([jnp.pi / 2]), jnp.zeros(1), jnp.zeros(1))
    side = dataclasses.replace(rest, quaternion=side, body_rate=jnp.asarray([[1.0, 2, 3]]))
    reading = imu.measure(SILENT, random_key(0), imu.ImuState.at(side), side, side, DT)
    for measured in (reading, imu.ImuState.at(side)):
        np.testing.assert_allclose(measured.accelerometer, [[0, GRAVITY, 0]], atol=1e-5)
        np.testing.assert_array_equal(measured.gyroscope, [[1, 2, 3]])
    for change, expected in (([0, 0, -GRAVITY], [0, 0, 0]), ([2, 0, 0], [2, 0, GRAVITY])):
        after = dataclasses.replace(rest, velocity=jnp.asarray([change]) * DT)
        reading = imu.measure(SILENT, random_key(0), imu.ImuState.at(rest), rest, after, DT)
        np.testing.assert_allclose(reading.accelerometer, [expected], atol=1e-5)


@pytest.fixture(scope="module")
def record() -> imu.ImuState:
    """400 readings of 400 resting IMUs, (400, 400, ...)."""
    config = ImuConfig(
        gyro_noise=1e-3, gyro_bias=2e-3, gyro_tau=50.0, accel_noise=4e-3, accel_bias=3e-3, accel_tau=80.0
    )

    @jax.jit
    def run(key: jax.Array) -> imu.ImuState:
        rest = resting(400)

        def one(state: imu.ImuState, i: jax.Array) -> tuple[imu.ImuState, imu.ImuState]:
            state = imu.measure(config, jax.random.fold_in(key, i), state, rest, rest, DT)
            return state, state

        return jax.lax.scan(one, imu.ImuState.at(rest), jnp.arange(400))[1]

    return jax.tree.map(lambda x: np.asarray(x, np.float64), run(random_key(7)))


@pytest.mark.parametrize(("what", "density"), [("gyro", 1e-3), ("accel", 4e-3)])
def test_white_noise(what: str, density: float, record: imu.ImuState) -> None:
    """A sample's deviation is N / sqrt(dt); a mean over m samples has the Allan deviation N / sqrt(m dt)."""
    reading = {"gyro": record.gyroscope, "accel": record.accelerometer - [0, 0, GRAVITY]}[what]
    noise = reading - {"gyro": record.gyro_bias, "accel": record.accel_bias}[what]
    assert abs(noise.mean()) < 5 * density / np.sqrt(DT) / np.sqrt(noise.size)
    for axis in range(3):
        assert noise[..., axis].std() == pytest.approx(density / np.sqrt(DT), rel=0.02)
    means = noise.reshape(4, 100, 400, 3).mean(1)
    allan = np.sqrt(np.mean(np.diff(means, axis=0) ** 2) / 2)
    assert allan == pytest.approx(density / np.sqrt(100 * DT), rel=0.05)


@pytest.mark.parametrize(
    ("what", "density", "walk"), [("gyro", 1e-3, 2e-3 / 50.0**0.5), ("accel", 4e-3, 3e-3 / 80.0**0.5)]
)
def test_allan_deviation(what: str, density: float, walk: float, record: imu.ImuState) -> None:
    """Of white noise N / sqrt(tau): N at 1 s; of a random walk K sqrt(tau / 3); of both, the root of their squares."""
    reading = {"gyro": record.gyroscope, "accel": record.accelerometer - [0, 0, GRAVITY]}[what]
    bias = {"gyro": record.gyro_bias, "accel": record.accel_bias}[what]
    assert allan_deviation(reading - bias, 30) == pytest.approx(density, rel=0.03)
    assert allan_deviation(bias, 30) == pytest.approx(walk * np.sqrt(1 / 3), rel=0.03)
    for group in (30, 60, 120):
        tau = group * DT
        expected = np.hypot(density / np.sqrt(tau), walk * np.sqrt(tau / 3))
        assert allan_deviation(reading, group) == pytest.approx(expected, rel=0.05)


@pytest.mark.parametrize(("what", "instability", "tau"), [("gyro", 2e-3, 50.0), ("accel", 3e-3, 80.0)])
def test_bias_walks(what: str, instability: float, tau: float, record: imu.ImuState) -> None:
    """Its variance grows by B^2 dt / tau a step, from zero."""
    bias = {"gyro": record.gyro_bias, "accel": record.accel_bias}[what]
    step = instability * np.sqrt(DT / tau)
    for k in (1, 100, 400):
        assert bias[k - 1].std() == pytest.approx(step * np.sqrt(k), rel=0.1)
    assert np.diff(bias, axis=0).std() == pytest.approx(step, rel=0.02)
    increments = np.diff(bias, axis=0)
    assert abs(np.mean(increments[1:] * increments[:-1])) < 0.02 * step**2


def test_noises_are_independent(record: imu.ImuState) -> None:
    noises = [
        record.gyroscope - record.gyro_bias, record.accelerometer - record.accel_bias,
        np.diff(record.gyro_bias, axis=0, prepend=0), np.diff(record.accel_bias, axis=0, prepend=0),
    ]  # fmt: skip
    flat = np.concatenate([n.reshape(-1, 3) for n in noises], axis=-1)
    correlation = np.corrcoef(flat.T) - np.eye(12)
    assert np.max(np.abs(correlation)) < 0.02


def test_seeds() -> None:
    rest = resting(3)
    start = imu.ImuState.at(rest)
    a, b, c = (imu.measure(ImuConfig(), random_key(s), start, rest, rest, DT).gyroscope for s in (1, 1, 2))
    np.testing.assert_array_equal(a, b)
    assert np.all(a != c)
    assert len(np.unique(a)) == 9
