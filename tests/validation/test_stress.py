"""Vehicles that are not the policy's: what each row changes, and what `eval --stress` says."""

import dataclasses
import json
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import e2efly
from e2efly.commands.cli import run
from e2efly.config import D435I, CameraConfig, EnvConfig, NoiseConfig, RewardConfig
from e2efly.environment import Env, random_key
from e2efly.environment.stress_rows import ALL, ROWS, Draw, rows_for, with_longer_queue
from e2efly.simulation.scenes.camera import mount
from e2efly.simulation.sensors.eyes import Eye
from e2efly.tasks import TASKS
from e2efly.validation.stress import stress
from e2efly.vehicles.loading import load_vehicle
from tests.validation.conftest import weighing

VIS_R = load_vehicle("vis_r")
N = 4000


def drawn(row: str, n: int = N, dtype: type = np.float64) -> Draw:
    draw = Draw.of(ROWS[row], VIS_R, VIS_R.latency, np.random.default_rng(0), n)
    return jax.tree.map(lambda x: np.asarray(x, dtype), draw)


def eye_in(row: str, camera: CameraConfig) -> Eye:
    """One of N cameras, at 30 Hz of control."""
    return drawn(row, dtype=np.float32).camera.eyes((camera,), (Eye.of(camera, random_key(0), N),), 1 / 30)[0]


def test_each_row_changes_what_it_says_and_nothing_else() -> None:
    nominal = drawn("nominal", 1)
    for name, value in nominal.plant.items():
        np.testing.assert_array_equal(value[0], getattr(VIS_R, name))
    for name, row in ROWS.items():
        if name in (ALL, "nominal"):
            continue
        draw = drawn(name, 3)
        for field, value in draw.plant.items():
            wanted = np.asarray(getattr(VIS_R, field)) * row.factors.get(field, 1.0)
            if field == "rotor_position":
                away = np.linalg.norm(value - wanted, axis=-1)
                np.testing.assert_allclose(away, row.centre_of_mass, atol=1e-12)
            else:
                np.testing.assert_allclose(value, np.broadcast_to(wanted, value.shape))
        np.testing.assert_allclose(draw.latency, max(VIS_R.latency + row.latency, 0.0))
        np.testing.assert_allclose(np.linalg.norm(draw.wind, axis=1), row.wind)
        np.testing.assert_allclose(np.sort(draw.disturbance.rotor_share, axis=1)[:, 0], 1 - row.rotor)
        np.testing.assert_array_equal(np.sort(draw.disturbance.rotor_share, axis=1)[:, 1:], 1.0)
        for field in ("sag", "drift_rate", "gust_speed"):
            wanted = {"sag": row.sag, "drift_rate": row.drift, "gust_speed": row.gust}[field]
            np.testing.assert_array_equal(getattr(draw.disturbance, field), wanted)
        assert NoiseConfig(*(float(x[0, 0]) for x in vars(draw.noise).values())) == row.noise  # type: ignore[index]
        np.testing.assert_array_equal(draw.disturbance.plain_mixer, float(row.plain_mixer))


def test_all_at_once_draws_each_between_the_extremes_of_the_rows() -> None:
    draw = drawn(ALL)
    mass = draw.plant["mass"] / VIS_R.mass
    assert (mass.min(), mass.max()) == (pytest.approx(0.8, abs=0.01), pytest.approx(1.25, abs=0.01))
    linear, quadratic = (draw.plant[f"drag_{x}"][:, 0] for x in ("linear", "quadratic"))
    np.testing.assert_allclose(linear / VIS_R.drag_linear[0], quadratic / VIS_R.drag_quadratic[0])
    assert draw.latency.min() == pytest.approx(0.03, abs=1e-3)
    assert draw.latency.max() == pytest.approx(0.10, abs=1e-3)
    assert abs(np.corrcoef(mass, draw.latency)[0, 1]) < 0.06


def test_each_row_of_cameras_changes_what_it_says_and_nothing_else() -> None:
    camera = dataclasses.replace(D435I, width=8, height=6, latency=(0.01, 0.09), angle_spread=0.3, rate=15.0)
    ideal = mount(dataclasses.replace(camera, angle_spread=0.0), N)
    for name, row in ROWS.items():
        if name == ALL:
            continue
        changed, seen = row.camera, eye_in(name, camera)
        np.testing.assert_allclose(seen.latency, 0.01 + changed.latency, atol=1e-7)
        np.testing.assert_array_equal(seen.every, 2 * changed.every)
        np.testing.assert_array_equal(seen.noisy, changed.noise)
        np.testing.assert_allclose(np.linalg.norm(seen.mount.offset, axis=1), changed.offset, atol=1e-6)
        matrix, wanted = (np.asarray(x.matrix, np.float64) for x in (seen.mount, ideal))
        wide = np.linalg.norm(matrix[:, :, 0], axis=1)  # the tangent of half the field of view
        np.testing.assert_allclose(wide, np.tan(D435I.fov[0] / 2 * (1 + changed.fov)), rtol=1e-5)
        turned = np.degrees(np.arccos(np.clip(np.einsum("ni,ni->n", matrix[:, :, 2], wanted[:, :, 2]), -1, 1)))
        assert turned.max() == pytest.approx(np.degrees(changed.turn), abs=0.05)
        if not (changed.turn or changed.fov):
            np.testing.assert_allclose(matrix, wanted, atol=1e-5)
    several = eye_in(ALL, camera)
    assert set(np.asarray(several.every)) == {2, 4}
    assert 0.45 < np.mean(several.noisy) < 0.55
    assert several.latency.min() == pytest.approx(0.01, abs=1e-4)
    assert several.latency.max() == pytest.approx(0.05, abs=1e-4)


def test_rows_of_cameras_are_for_those_who_see() -> None:
    blind = [name for name, row in ROWS.items() if not row.camera.there]
    assert sorted(rows_for(())) == sorted(blind)
    assert rows_for(())[-1] == ALL
    mask = rows_for(TASKS["land_visual"].cameras)
    assert set(mask) == set(ROWS) - {"noise of a D435i"}
    assert set(rows_for(TASKS["avoid"].cameras)) == set(ROWS)
    refused = r"--rows has 'noise of a D435i', but the policy sees mask; accepted: 'nominal'"
    with pytest.raises(ValueError, match=refused):
        stress("land_visual", 10, rows=("noise of a D435i",))


@pytest.mark.whole
def test_images_are_as_old_and_as_rare_as_a_row_says() -> None:
    """A vehicle that climbs at 3 m/s over a ground that it looks at: its image tells where it was, and when."""
    down = CameraConfig("depth", width=16, height=16, fov=(0.9, 0.9), pitch=np.pi / 2, reach=(0.0, 50.0))
    rows = ("nominal", "images 40 ms older", "images half as often")
    heights = {}
    for row in rows:
        env = Env.of(TASKS["hover"].training(), RewardConfig({"v1": 1.0}), EnvConfig(cameras=(down,)))
        draw = drawn(row, 3, np.float32)
        state, _ = jax.jit(Env.reset, static_argnums=2)(with_longer_queue(env), random_key(1), 3)
        vehicle = dataclasses.replace(
            state.vehicle, position=jnp.array([[0.0, 0, 5]] * 3), velocity=jnp.array([[0.0, 0, 3]] * 3),
            quaternion=jnp.array([[1.0, 0, 0, 0]] * 3), body_rate=jnp.zeros((3, 3)),
        )  # fmt: skip
        past = jax.tree.map(lambda x, now: jnp.broadcast_to(now[:, None], x.shape), state.past, vehicle)
        state = draw.state(env, dataclasses.replace(state, vehicle=vehicle, past=past))
        flown, seen = draw.env(with_longer_queue(env)), []
        level = jnp.broadcast_to(flown.hover, (3, 4))
        step = jax.jit(lambda state, flown=flown, level=level: flown.step(state, level, restart=False))
        for _ in range(8):
            state, _ = step(state)
            seen.append((float(state.images[0][0, 0, 0]), float(state.vehicle.position[0, 2])))
        heights[row] = np.array(seen)
    image, truth = heights["nominal"].T
    np.testing.assert_allclose(image, truth, atol=2e-3)
    image, truth = heights["images 40 ms older"].T
    assert np.mean((truth - image)[3:]) == pytest.approx(0.12, abs=0.01)
    image, truth = heights["images half as often"].T
    assert np.sum(np.abs(image - truth) < 2e-3) == 4
    assert np.sum(np.abs(image[1:] - truth[:-1]) < 2e-3) >= 3


@pytest.mark.whole
def test_the_nominal_row_is_the_evaluation() -> None:
    plain, report = e2efly.evaluate("hover", 50), stress("hover", 50, rows=("nominal", "mass x1.25"))
    a, b = plain.flown["hover"], report.flown["nominal"]["hover"]
    np.testing.assert_array_equal(a.success, b.success)
    np.testing.assert_allclose(a.final_error, b.final_error, atol=2e-4)
    assert (report.trained.success, report.untrained.success) == (report.success, {})
    heavy = report.flown["mass x1.25"]["hover"]
    assert np.mean(heavy.final_error) > np.mean(b.final_error)


@pytest.mark.whole
def test_the_command_reports_and_judges(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out, plots = tmp_path / "stress.json", tmp_path / "plots"
    asked = ["eval", "hover", "--stress", "--rows", "bent propeller", "nominal", "delay +20 ms", "--episodes", "20"]
    assert run([*asked, "--json", str(out), "--plots", str(plots), "--least", "0.9"]) == 0
    said = json.loads(out.read_text())
    rows = said["stress"]
    assert list(rows) == ["nominal", "delay +20 ms"]
    assert list(said["untrained"]) == ["bent propeller"]
    assert rows["nominal"]["hover"]["episodes"] == 20
    assert (plots / "stress.png").stat().st_size > 10_000
    assert "delay +20 ms" in capsys.readouterr().out
    asked = ["eval", "hover_aware", "--vehicle", "crazyflie", "--stress", "--rows", "gusts 1.5 m/s", "--episodes", "20"]
    asked += ["--plots", str(plots)]
    assert run([*asked, "--least", "1.0"]) == 1
    assert "100.0% is asked for" in capsys.readouterr().out


def test_rows_are_numbers_of_one_program() -> None:
    """No row sets a shape: every leaf of every draw has the same shape."""
    shapes = {tuple(np.shape(leaf) for leaf in jax.tree.leaves(drawn(row, 5))) for row in ROWS}
    assert len(shapes) == 1


@pytest.fixture(scope="module")
def forgetful(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A policy without a memory, which hangs lower under more weight."""
    out = tmp_path_factory.mktemp("forgetful") / "run"
    e2efly.train("hover", "bptt", preset_name="nominal", out=out)
    return out


@pytest.mark.whole
@pytest.mark.parametrize("controller", ["policy", "plant"])
def test_the_rows_change_the_vehicle_that_flies(controller: str, tmp_path: Path, forgetful: Path) -> None:
    """The nominal row is what `evaluate` flies of another vehicle; the mass of a row is about that vehicle's."""
    heavy = weighing(VIS_R.mass / 0.8, tmp_path)
    flies = {"vehicle": heavy, "controller": controller}
    plain = e2efly.evaluate(forgetful, 20, **flies)  # type: ignore[arg-type]
    report = stress(forgetful, 20, rows=("nominal", "mass x0.8"), **flies)  # type: ignore[arg-type]
    assert (report.as_json()["vehicle"], report.as_json()["controller"]) == (heavy, controller)
    a, b, light = (
        float(np.median(found["hover"].final_error))
        for found in (plain.flown, report.flown["nominal"], report.flown["mass x0.8"])
    )
    assert a == pytest.approx(b, abs=2e-3)
    own = stress(forgetful, 20, rows=("nominal",)).flown["nominal"]["hover"]
    if controller == "policy":  # the lighter vehicle has the mass of the policy's own
        assert b > light + 0.02
        assert light == pytest.approx(float(np.median(own.final_error)), abs=2e-3)
    else:
        assert light > b + 0.01
