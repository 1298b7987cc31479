"""Laws that no training draws from: each beside its own definition, computed here with NumPy or by hand."""

import ast
import dataclasses
import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jax
import numpy as np
import pytest

import e2efly
from e2efly.config import DisturbanceConfig, EnvConfig, ImuConfig, NoiseConfig, RewardConfig
from e2efly.control import Quat
from e2efly.environment import Env, random_key, stress_rows
from e2efly.environment.episodes import Act, run_stepwise
from e2efly.environment.stress_rows import ROWS
from e2efly.runs import presets
from e2efly.tasks import TASKS
from e2efly.validation import stress_laws
from e2efly.validation.evaluation import BATCH
from e2efly.validation.law_step import LawMemory, LawStep, air_of, arrived, observed
from e2efly.validation.plant import Delay
from e2efly.validation.plant_stress import stress as on_plant
from e2efly.validation.stress import draw_of, fly_law, law_of, laws_of, stress
from e2efly.validation.stress_laws import LATEST, LAWS, LawSetting, bursts, dryden, steps_of
from e2efly.vehicles.loading import load_vehicle, vehicle_names
from e2efly.vehicles.vehicle import Vehicle

VIS_R = load_vehicle("vis_r")
PERIOD, N, STEPS = 1 / 30, 400, 300
TIPPING = np.tile(np.array([0.1, 0.2, -0.1, 0.1], np.float32), (BATCH, 1))
"""Actions that tip a vehicle over."""
FULL = np.tile(np.array([1.0, 0.0, 0.0, 0.0], np.float32), (BATCH, 1))
"""Actions of full thrust."""
BELOW = ("config", "vehicles", "control", "courses", "policy", "tasks", "simulation", "runs", "environment", "learning")
"""Rooms of which a training consists."""


def setting(n: int = N, steps: int = STEPS, vehicle: Vehicle = VIS_R, period: float = PERIOD) -> LawSetting:
    return LawSetting(vehicle, np.random.default_rng(0), n, steps, period)


def law(name: str, **kind: Any) -> LawStep:
    return steps_of(LAWS[name], setting(**kind))


def one(**changes: Any) -> LawStep:
    """A control step of one flight, without a law but for these entries."""
    plain = steps_of(None, setting(1, 1)).of(0).at(0)
    return dataclasses.replace(plain, **{name: np.asarray(value) for name, value in changes.items()})


@dataclasses.dataclass(frozen=True)
class Motion:
    """The motion of one vehicle."""

    position: np.ndarray
    velocity: np.ndarray
    quaternion: np.ndarray
    body_rate: np.ndarray


def moving(seed: int = 0, tilt: float = 0.2) -> Motion:
    rng = np.random.default_rng(seed)
    attitude = np.array(Quat.of_euler(*rng.uniform(-tilt, tilt, 3)).stack())
    return Motion(rng.normal(size=3) + 2 * np.eye(3)[2], rng.normal(size=3), attitude, rng.normal(size=3))


def begun(motion: Motion, period: float = PERIOD) -> LawMemory:
    return LawMemory.of(motion, np.zeros(4), period, LATEST)


def test_no_training_can_draw_a_law() -> None:
    """Neither by its name as an option, nor by an import from the rooms that train; and no row has a law's name."""
    assert not set(LAWS) & set(ROWS)
    assert 2 * len(LAWS) >= len(LAWS) + len([row for row in ROWS.values() if not row.camera.there])
    functions = {
        name
        for name, value in vars(stress_laws).items()
        if callable(value) and value.__module__ == stress_laws.__name__
    }
    options = {
        f.name for part in (EnvConfig, DisturbanceConfig, NoiseConfig, ImuConfig) for f in dataclasses.fields(part)
    }
    assert not functions & options
    root = Path(e2efly.__file__).parent
    for file in (file for room in BELOW for file in (root / room).rglob("*.py")):
        names = {
            name
            for node in ast.walk(ast.parse(file.read_text(encoding="utf-8")))
            if isinstance(node, (ast.Import, ast.ImportFrom))
            for name in (getattr(node, "module", None) or "", *(alias.name for alias in node.names))
        }
        assert not [name for name in names if "stress_laws" in name or "law_step" in name], file


def test_the_page_of_the_stress_names_every_law() -> None:
    page = (Path(__file__).parents[2] / "docs" / "robustness.md").read_text(encoding="utf-8")
    assert [name for name in LAWS if not re.search(rf"[|,] {name}[ ,|]", page)] == []


def test_no_preset_changes_a_field_of_the_vehicle_that_a_law_changes() -> None:
    laws = {name for row in LAWS.values() for name in row.alters}
    assert {"thrust_map", "motor_time_constant_down", "gyro_time_constant"} < laws
    for preset in (presets.OTHERS, presets.AROUND, presets.BESIDE_FAMILY):
        assert not laws & set(preset.randomize)


def test_without_a_law_nothing_changes() -> None:
    motion, before, action = moving(), moving(1), np.array([0.3, -0.2, 1.0, -1.0])
    felt = begun(before)
    seen, felt = observed(one(), felt, motion, PERIOD)
    for name in ("position", "velocity", "quaternion", "body_rate"):
        np.testing.assert_array_equal(getattr(seen, name), getattr(motion, name))
    np.testing.assert_array_equal(arrived(one(), felt, action)[0], action)
    wind, share = air_of(one(), motion)
    np.testing.assert_array_equal(wind, np.zeros(3))
    np.testing.assert_array_equal(share, np.ones(4))


@pytest.fixture(scope="module")
def short() -> tuple[Env, Act]:
    """Half a second of a hover with a constant command that tips over."""
    task = dataclasses.replace(TASKS["hover"].training(), episode_s=0.5, hold_s=0.1)
    env = Env.of(task, RewardConfig({"v1": 1.0}), EnvConfig())
    env = dataclasses.replace(env, queue=env.queue + 2)
    act = Act(lambda observation, images, memory: (TIPPING, memory))
    return env, act


def under(name: str | None, short: tuple[Env, Act]) -> Any:
    env, act = short
    draw = jax.tree.map(lambda x: np.asarray(x, np.float32), draw_of(ROWS["nominal"], VIS_R, VIS_R.latency, 1, 0))
    whole = steps_of(None, setting(BATCH, 15)) if name is None else law_of(LAWS[name], VIS_R, 1, 0, 15, PERIOD)
    return fly_law(draw.env(env), act, random_key(1), draw, whole, 0.0)


def test_a_flight_without_a_law_is_the_nominal_row(short: tuple[Env, Act]) -> None:
    env, act = short
    draw = jax.tree.map(lambda x: np.asarray(x, np.float32), draw_of(ROWS["nominal"], VIS_R, VIS_R.latency, 1, 0))
    plain = run_stepwise(draw.env(env), act, random_key(1), BATCH, 15, 0.0, lambda state: draw.state(env, state))[0]
    for a, b in zip(jax.tree.leaves(plain), jax.tree.leaves(under(None, short)), strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-5, atol=1e-5)


def test_a_flight_under_each_law_is_finite_and_a_law_of_the_vehicle_changes_it(short: tuple[Env, Act]) -> None:
    still = under(None, short)
    for name, row in LAWS.items():
        flown = under(name, short)
        assert all(np.isfinite(leaf).all() for leaf in jax.tree.leaves(flown)), name
        # a policy that does not look is moved by what moves the vehicle alone
        moved = np.abs(flown.final_error - still.final_error).max() > 1e-6
        assert moved == bool(row.alters) or name in MOVES or name in TOO_SHORT, name
    climbing = short[0], Act(lambda observation, images, memory: (FULL, memory))
    fastest = {name: under(name, climbing).top_speed.mean() for name in (None, "hot motors", "worn motors")}
    assert max(fastest["hot motors"], fastest["worn motors"]) < fastest[None] - 0.02


MOVES = {name for name in LAWS if name.startswith(("commands", "play", "delay"))}
"""Laws of the command, which move a vehicle whose command differs from the one before."""
TOO_SHORT = ("hot motors", "worn motors", "ground effect")
"""Laws that show at full thrust or near the ground."""


def test_the_velocity_is_delayed_and_not_smoothed() -> None:
    rng, period = np.random.default_rng(0), LATEST / 4
    velocities = rng.normal(size=(20, 3))
    felt, seen = begun(dataclasses.replace(moving(), velocity=velocities[0]), period), []
    for velocity in velocities:
        shown, felt = observed(one(velocity_age=LATEST), felt, dataclasses.replace(moving(), velocity=velocity), period)
        seen.append(shown.velocity)
        np.testing.assert_array_equal(shown.position, moving().position)
    np.testing.assert_allclose(seen[4:], velocities[:-4], atol=1e-12)
    np.testing.assert_allclose(seen[:5], np.broadcast_to(velocities[0], (5, 3)))


def test_a_velocity_of_differences_is_that_of_the_observed_positions() -> None:
    positions, errors = np.random.default_rng(0).normal(size=(2, 9, 3))
    felt, seen = begun(moving()), []
    for position, error in zip(positions, errors, strict=True):
        step = one(derived=1.0, error=np.concatenate([error, np.zeros(9)]))
        shown, felt = observed(step, felt, dataclasses.replace(moving(), position=position), PERIOD)
        np.testing.assert_allclose(shown.position, position + error)
        seen.append(shown.velocity)
    np.testing.assert_allclose(seen[1:], np.diff(positions + errors, axis=0) / PERIOD)


def test_a_held_pose_is_the_last_one_that_was_shown_and_body_rates_go_on() -> None:
    felt, seen = begun(moving(0)), []
    for k, held in enumerate((0, 1, 1, 0)):
        shown, felt = observed(one(held=held), felt, moving(k), PERIOD)
        seen.append(shown)
    for name in ("position", "velocity", "quaternion", "body_rate"):
        for k, of in enumerate((0, 1, 2, 3) if name == "body_rate" else (0, 0, 0, 3)):
            np.testing.assert_allclose(getattr(seen[k], name), getattr(moving(of), name), atol=1e-12)


def test_errors_of_the_attitude_turn_it_as_they_say() -> None:
    motion = moving()
    shown, _ = observed(one(heading=0.3), begun(motion), motion, PERIOD)
    assert Quat.of(shown.quaternion).yaw() - Quat.of(motion.quaternion).yaw() == pytest.approx(0.3)
    assert Quat.of(shown.quaternion).tilt() == pytest.approx(Quat.of(motion.quaternion).tilt())
    step = one(error=np.eye(12)[6] * 0.01)  # half of a rotation about body x
    shown, _ = observed(step, begun(motion), motion, PERIOD)
    between = Quat.of(motion.quaternion).conjugate().compose(Quat.of(shown.quaternion))
    assert 2 * between.x == pytest.approx(0.02, rel=1e-3)
    # a thrust of twice the weight straight up: one weight above its own
    climbing = dataclasses.replace(motion, velocity=motion.velocity + 9.81 * PERIOD * np.eye(3)[2])
    shown, _ = observed(one(heading_by_load=0.1), begun(motion), climbing, PERIOD)
    turned = Quat.of(shown.quaternion).yaw() - Quat.of(motion.quaternion).yaw()
    assert turned == pytest.approx(0.1, rel=1e-3)


def test_what_is_coarse_is_in_steps() -> None:
    motion, grain = moving(), np.array([0.01, 0.05, 1 / 128, 0.05])
    shown, _ = observed(one(grain=grain), begun(motion), motion, PERIOD)
    for name, step in zip(("position", "velocity", "body_rate"), grain[[0, 1, 3]], strict=True):
        np.testing.assert_allclose(getattr(shown, name), np.round(getattr(motion, name) / step) * step)
    assert np.linalg.norm(shown.quaternion) == pytest.approx(1)
    wanted = np.round(motion.quaternion * 128)
    np.testing.assert_allclose(shown.quaternion, wanted / np.linalg.norm(wanted))
    sent = arrived(one(command_grain=2 / 255), begun(motion), np.array([0.1, -0.7, 1.0, 3.0]))[0]
    levels = (sent + 1) / (2 / 255)
    np.testing.assert_allclose(sent[2:], 2 / 255 * np.round(255 / 2))
    np.testing.assert_allclose(np.diff(levels), np.round(np.diff(levels)), atol=1e-9)


def test_lost_commands_and_play_leave_the_last_one_acting() -> None:
    felt, heard = begun(moving()), []
    for value, lost in ((0.5, 0), (0.9, 1), (-0.4, 1), (-0.4, 0)):
        acting, felt = arrived(one(lost=lost), felt, np.full(4, value))
        heard.append(acting[0])
    assert heard == [0.5, 0.5, 0.5, -0.4]
    felt, heard = begun(moving()), []
    for value in (0.5, 0.495, 0.52, 0.505, 0.49):
        acting, felt = arrived(one(play=0.01), felt, np.full(4, value))
        heard.append(acting[0])
    np.testing.assert_allclose(heard, [0.49, 0.49, 0.51, 0.51, 0.5])


def test_bursts_are_of_a_chain_of_two_states() -> None:
    share, mean = 0.1, 0.2
    bad = bursts(setting(2000, 1000), share, mean)
    assert set(np.unique(bad)) == {0.0, 1.0}
    assert not bad[0].any()
    assert bad[200:].mean() == pytest.approx(share, rel=0.05)
    edges = np.diff(np.pad(bad, ((1, 1), (0, 0))), axis=0)
    begins, ends = (np.argwhere(sign == edges.T)[:, 1] for sign in (1, -1))
    lengths = (ends - begins)[ends < len(bad)]
    ending = PERIOD / mean
    for k in range(1, 20):  # geometric: the chance to last longer than k is (1 - p)^k
        assert np.mean(lengths > k) == pytest.approx((1 - ending) ** k, abs=0.012)
    for name, entry, of in (("poses held in bursts", "held", 0.1), ("commands lost in bursts", "lost", 0.05)):
        assert np.mean(getattr(law(name, n=2000), entry)) == pytest.approx(of, rel=0.1)


def test_turbulence_has_the_spectrum_of_dryden() -> None:
    """One-sided densities at 10 ft, with the mean wind carrying the turbulence past the vehicle."""
    mean, period = 6.0, 0.05
    found = dryden(setting(600, 2048, period=period), mean)
    base = 0.177 + 0.000823 * 10
    lengths = np.array([10 / base**1.2, 10 / base**1.2, 10]) * 0.3048
    sigmas = 0.1 * mean / np.array([base**0.4, base**0.4, 1])
    np.testing.assert_allclose(found.std(axis=(0, 1)), sigmas, rtol=0.05)
    assert np.abs(found[:100].std(axis=(0, 1)) / sigmas - 1).max() < 0.08  # settled from the first step on
    window = np.hanning(2048)[:, None, None]
    spectrum = np.abs(np.fft.rfft(found * window, axis=0)) ** 2 * 2 * period / np.sum(window**2)
    frequency = np.fft.rfftfreq(2048, period)
    chosen = (frequency > 0.05) & (frequency < 2.0)
    measured = spectrum.mean(axis=1)[chosen]
    reach = 2 * np.pi * frequency[chosen, None] * lengths / mean
    wanted = 4 * sigmas**2 * lengths / mean / (1 + reach**2)
    wanted[:, 1:] = 2 * sigmas[1:] ** 2 * lengths[1:] / mean * ((1 + 3 * reach**2) / (1 + reach**2) ** 2)[:, 1:]
    blocks = np.array_split(np.arange(len(measured)), 12)
    for rows in blocks:
        np.testing.assert_allclose(measured[rows].mean(0), wanted[rows].mean(0), rtol=0.08)
    assert abs(np.corrcoef(found[..., 0].ravel(), found[..., 1].ravel())[0, 1]) < 0.02


def test_wind_falls_towards_the_ground_and_scales_with_the_vehicle() -> None:
    storm = law("wind with shear and turbulence")
    assert np.linalg.norm(storm.wind.mean(0), axis=-1).mean() == pytest.approx(6.0, rel=0.1)
    small = law("wind with shear and turbulence", vehicle=load_vehicle("crazyflie"))
    size = setting(vehicle=load_vehicle("crazyflie")).size
    assert size == pytest.approx(0.61, abs=0.05)
    assert np.linalg.norm(small.wind.mean(0), axis=-1).mean() == pytest.approx(6 * math.sqrt(size), rel=0.1)
    for height, share in ((20 * 0.3048, 1.0), (3.0, math.log(3 / 0.04572) / math.log(20 / 0.15)), (0.0, 0.0)):
        at = dataclasses.replace(moving(), position=np.array([0.0, 0.0, height]))
        wind, _ = air_of(one(wind=[2.0, 0, 0], shear=1.0), at)
        assert wind[0] == pytest.approx(2 * share)
    front = np.linalg.norm(law("gust front").wind, axis=-1)
    assert front[0].max() == 0.0
    np.testing.assert_allclose(front[-1], 5.0)
    begin = np.argmax(front > 0, axis=0) - 1
    middle = front[begin + 15, np.arange(N)]  # half a second after its start it is half as strong, within a step
    assert np.all((middle > 2.0) & (middle < 3.01))
    turning = law("wind that turns").wind
    np.testing.assert_allclose(np.linalg.norm(turning, axis=-1), 3.0)
    np.testing.assert_allclose(turning[90], turning[0], atol=1e-9)
    np.testing.assert_allclose(turning[45], -turning[0], atol=1e-9)


def test_heavy_tails_have_the_quantiles_of_student() -> None:
    """The distribution function of Student's t with three degrees of freedom is known in closed form."""
    error = law("noise with heavy tails").error
    for part, scale in ((slice(0, 3), 0.004), (slice(3, 6), 0.03), (slice(6, 9), 0.002), (slice(9, 12), 0.02)):
        t = error[..., part].ravel() / scale
        for x in (-6.0, -2.0, -0.5, 0.0, 1.0, 3.0, 10.0):
            u = x / math.sqrt(3)
            below = 0.5 + (u / (1 + u**2) + math.atan(u)) / math.pi
            assert np.mean(t < x) == pytest.approx(below, abs=0.004)


def test_what_walks_walks() -> None:
    walk = law("gyroscope's bias walks").error[..., 9:12]
    for k in (30, 120, 270):
        assert np.std(walk[k]) == pytest.approx(0.02 * math.sqrt((k + 1) * PERIOD), rel=0.1)
    for degrees in (5, 10):
        heading = np.degrees(law(f"heading drifts by {degrees} degrees").heading)
        np.testing.assert_allclose(np.abs(heading).max(axis=0), degrees)
        changes = np.diff(heading, axis=0)
        assert abs(np.mean(changes[1:] * changes[:-1])) < 0.02 * np.mean(changes**2)
    later = law("delay walks").later
    assert LATEST <= stress_rows.LATEST  # the queue of commands is as long as the rows need
    assert later.min() >= 0
    assert later.max() <= LATEST
    assert np.std(np.diff(later, axis=0)) == pytest.approx(0.02 * math.sqrt(PERIOD), rel=0.15)


def test_a_delay_in_a_sawtooth_grows_evenly_and_falls_at_once() -> None:
    later = law("delay in a sawtooth").later
    changes = np.diff(later, axis=0)
    rising = changes > 0
    np.testing.assert_allclose(changes[rising], LATEST * PERIOD / 2, rtol=1e-6)
    np.testing.assert_allclose(changes[~rising], LATEST * PERIOD / 2 - LATEST, rtol=1e-6)
    assert np.mean(~rising) == pytest.approx(PERIOD / 2, rel=0.1)
    delay = Delay.of(0.08, np.zeros(1)).send(np.array([1.0]), 0.0)
    delay = dataclasses.replace(delay, latency=0.04).send(np.array([2.0]), 0.03)  # it overtakes
    _, parts = delay.until(0.0, 0.1)
    assert [(c[0], pytest.approx(s)) for c, s in parts] == [(0.0, 0.07), (2.0, 0.03)]


def test_periodic_errors_have_their_frequency_and_size() -> None:
    shake = law("bent propeller", n=50).error[..., 9:11]
    np.testing.assert_allclose(np.linalg.norm(shake, axis=-1), 0.5)
    turns = np.unwrap(np.arctan2(shake[..., 0], shake[..., 1]), axis=0)
    alias = np.diff(turns, axis=0)[0] / (2 * np.pi)  # turns per control step, in (-1/2, 1/2]
    hover = VIS_R.hover_rotor_speed / (2 * np.pi) * PERIOD
    possible = np.arange(-200, 200)[:, None] + alias
    assert np.all((np.abs(possible / hover - 1) < 0.0301).any(axis=0))
    mount = law("mount that swings", n=50).error
    np.testing.assert_allclose(np.linalg.norm(2 * mount[..., 6:9], axis=-1), math.radians(2))
    wave = np.fft.rfft(mount[..., 0], axis=0)
    assert np.all(np.abs(np.fft.rfftfreq(STEPS, PERIOD)[np.argmax(np.abs(wave), axis=0)] - 7.0) < 1e-9)
    radio = law("positions with multipath", n=50).error
    np.testing.assert_allclose(np.abs(radio[..., 0:3]).sum(-1).max(0), 0.03, rtol=0.02)
    radio = np.fft.rfft(radio[..., 0:3].sum(-1), axis=0)
    assert np.all(np.abs(np.fft.rfftfreq(STEPS, PERIOD)[np.argmax(np.abs(radio), axis=0)] - 0.7) < 1e-9)


def test_single_errors_are_as_large_and_as_rare_as_they_say() -> None:
    away = np.linalg.norm(law("positions with outliers").error[..., 0:3], axis=-1)
    np.testing.assert_allclose(away[away > 0], 0.2)
    assert np.mean(away > 0) == pytest.approx(0.02, rel=0.1)
    stretch = law("metre 1 % wrong").stretch
    np.testing.assert_allclose(np.abs(stretch), 0.01)
    shown, _ = observed(one(stretch=0.01), begun(moving()), moving(), PERIOD)
    np.testing.assert_allclose(shown.position, 1.01 * moving().position)


def test_thrust_changes_as_the_laws_say() -> None:
    share = law("battery collapses").share
    assert set(np.round(np.unique(share), 12)) == {0.85, 1.0}
    assert np.all(np.diff(share, axis=0) <= 0)
    np.testing.assert_array_equal(share[-1], 0.85)
    np.testing.assert_array_equal(share[..., :1] + np.zeros(4), share)
    chipped = law("propeller chips in flight").share
    np.testing.assert_allclose(np.sort(chipped[-1], axis=-1), np.broadcast_to([0.9, 1, 1, 1], (N, 4)))
    rough = law("rough bearing").share - 1
    assert np.all((np.abs(rough).max(axis=0) > 0.095).sum(axis=-1) == 1)
    np.testing.assert_allclose(rough[20], rough[0], atol=1e-9)  # three times in 60 control steps
    dips = law("brown-outs", n=2000).share
    assert set(np.unique(dips)) == {0.75, 1.0}
    assert np.mean(dips < 1) == pytest.approx(0.1, rel=0.1)
    lost = law("motor loses its step", n=2000).share
    assert np.mean(lost == 0.5) == pytest.approx(0.02 / 4, rel=0.15)


def test_thrust_in_moving_air_and_near_the_ground() -> None:
    level = dataclasses.replace(moving(), quaternion=np.eye(4)[0], velocity=np.array([3.0, 0.0, 2.0]))
    assert air_of(one(inflow=0.02), level)[1] == pytest.approx(np.full(4, 0.96))
    assert air_of(one(inflow=0.02, wind=[0.0, 0.0, 5.0]), level)[1] == pytest.approx(np.full(4, 1.06))
    radius = float(law("ground effect", n=1, steps=1).cushion[0, 0])
    assert radius == pytest.approx(0.15)
    for height in (0.15, 0.3, 1.0):
        at = dataclasses.replace(level, position=np.array([0.0, 0.0, height]))
        assert air_of(one(cushion=radius), at)[1] == pytest.approx(np.full(4, 1 / (1 - (0.15 / (4 * height)) ** 2)))
    below = dataclasses.replace(level, position=np.array([0.0, 0.0, -1.0]))
    assert air_of(one(cushion=radius), below)[1] == pytest.approx(np.full(4, 16 / 15))


def test_ceilings_fall_with_heat_and_by_a_power_law() -> None:
    hot = law("hot motors").ceiling
    assert hot[0, 0] == 1.0
    np.testing.assert_allclose(hot[90], 0.8 + 0.2 * math.exp(-1))
    lost = 1 - law("worn motors", n=20_000, steps=1).ceiling[0]
    for y in (0.02, 0.04, 0.1, 0.2):
        assert np.mean(lost > y) == pytest.approx((y / 0.02) ** -1.5, abs=0.01)
    assert lost.max() <= 0.3 + 1e-12


@pytest.mark.parametrize("name", vehicle_names())
def test_another_vehicle_has_the_same_hover(name: str) -> None:
    vehicle = load_vehicle(name)
    bent = law("bent thrust curve", n=1, steps=1, vehicle=vehicle).thrust_map[0, 0]
    other = dataclasses.replace(vehicle, thrust_map=bent)
    hover, full = vehicle.hover_rotor_speed, vehicle.full_rotor_speed
    assert other.rotor_thrust(hover) == pytest.approx(vehicle.rotor_thrust(hover))
    assert other.rotor_thrust(full) == pytest.approx(0.88 * vehicle.thrust_range[1], rel=1e-6)
    assert other.rotor_thrust(0.7 * hover) > vehicle.rotor_thrust(0.7 * hover)
    slow = law("rotors slow down slowly", n=1, steps=1, vehicle=vehicle).motor_time_constant_down
    assert slow[0, 0] == pytest.approx(2 * vehicle.motor_time_constant)
    assert law("filtered gyroscope", n=1, steps=1, vehicle=vehicle).gyro_time_constant[0, 0] == 0.01


def test_what_moves_in_the_vehicle_moves_once() -> None:
    off = np.linalg.norm(law("loose battery").shift, axis=-1)
    np.testing.assert_allclose(off[0], 0.0)
    np.testing.assert_allclose(off[-1], 0.004)
    assert np.all((np.diff(off, axis=0) > 0).sum(axis=0) == 1)
    mass = law("payload falls off").mass
    assert np.all(mass[0] == 1)
    np.testing.assert_allclose(mass[-1], 0.85)
    assert np.all((np.diff(mass, axis=0) < 0).sum(axis=0) == 1)
    away = law("loose battery", n=4000, steps=10).shift[-1]
    assert np.abs(away.mean(axis=0)).max() < 0.0002


def test_few_flights_are_the_first_of_many() -> None:
    few, many = (laws_of(LAWS["noise with heavy tails"], VIS_R, 1, n, 20, PERIOD) for n in (3, 260))
    assert many.error.shape == (20, 260, 12)
    np.testing.assert_array_equal(few.error, many.error[:, :3])
    assert not np.array_equal(many.error[:, 0], many.error[:, 250])


ON_PLANTS = (
    "velocity 40 ms late", "velocity from differences", "heading drifts by 10 degrees", "noise with heavy tails",
    "poses held in bursts", "commands lost in bursts", "play of the commands", "wind with shear and turbulence",
    "rough bearing", "worn motors", "bent thrust curve", "rotors slow down slowly", "filtered gyroscope",
)  # fmt: skip


@pytest.mark.whole
def test_a_law_on_a_plant_is_that_of_the_training_simulator(policy_of: Callable[..., Path]) -> None:
    """Flight by flight: the same numbers, computed with NumPy in one place and with JAX in the other."""
    policy = policy_of("hover")
    found, wanted = on_plant(policy, "simulator", 2, rows=ON_PLANTS), stress(policy, 2, rows=("nominal", *ON_PLANTS))
    still = wanted.flown["nominal"]["hover"].mean_error
    for row in ON_PLANTS:
        ours, theirs = found.flown[row]["hover"], wanted.flown[row]["hover"]
        np.testing.assert_array_equal(ours.success, theirs.success, err_msg=row)
        np.testing.assert_allclose(ours.mean_error, theirs.mean_error, atol=2e-3, err_msg=row)
        assert row == "worn motors" or np.abs(theirs.mean_error - still).max() > 1e-6, row


def test_what_a_plant_cannot_do_is_left_out_by_name(policy_of: Callable[..., Path]) -> None:
    with pytest.raises(ValueError, match="'loose battery', but plant 'simulator' cannot change centre of mass in fli"):
        on_plant(policy_of("hover"), "simulator", 1, rows=("loose battery",))
