"""Vehicles that are not the policy's: what each row changes, and what `eval --stress` says."""

import json
from pathlib import Path

import numpy as np
import pytest

import e2efly
from e2efly.cli import run
from e2efly.config import NoiseConfig
from e2efly.env.stress import ALL, ROWS, Draw
from e2efly.stress import stress
from e2efly.vehicles import load_vehicle, vehicle_file

VIS_R = load_vehicle("vis_r")
N = 4000


def drawn(row: str, n: int = N) -> Draw:
    return Draw.of(ROWS[row], VIS_R, np.random.default_rng(0), n)


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
        np.testing.assert_array_equal(draw.plain_mixer, float(row.plain_mixer))


def test_all_at_once_draws_each_between_the_extremes_of_the_rows() -> None:
    draw = drawn(ALL)
    mass = draw.plant["mass"] / VIS_R.mass
    assert (mass.min(), mass.max()) == (pytest.approx(0.8, abs=0.01), pytest.approx(1.25, abs=0.01))
    linear, quadratic = (draw.plant[f"drag_{x}"][:, 0] for x in ("linear", "quadratic"))
    np.testing.assert_allclose(linear / VIS_R.drag_linear[0], quadratic / VIS_R.drag_quadratic[0])
    assert draw.latency.min() == pytest.approx(0.03, abs=1e-3)
    assert draw.latency.max() == pytest.approx(0.10, abs=1e-3)
    assert abs(np.corrcoef(mass, draw.latency)[0, 1]) < 0.06


def test_the_nominal_row_is_the_evaluation() -> None:
    plain, report = e2efly.evaluate("hover", 50), stress("hover", 50, rows=("nominal", "mass x1.25"))
    a, b = plain.flown["hover"], report.flown["nominal"]["hover"]
    np.testing.assert_array_equal(a.success, b.success)
    np.testing.assert_allclose(a.final_error, b.final_error, atol=2e-4)
    heavy = report.flown["mass x1.25"]["hover"]
    assert np.mean(heavy.final_error) > np.mean(b.final_error)


def test_the_command_reports_and_judges(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out, plots = tmp_path / "stress.json", tmp_path / "plots"
    asked = ["eval", "hover", "--stress", "--rows", "nominal", "delay +20 ms", "--episodes", "20"]
    assert run([*asked, "--json", str(out), "--plots", str(plots), "--least", "0.9"]) == 0
    rows = json.loads(out.read_text())["stress"]
    assert list(rows) == ["nominal", "delay +20 ms"]
    assert rows["nominal"]["hover"]["episodes"] == 20
    assert (plots / "stress.png").stat().st_size > 10_000
    assert "delay +20 ms" in capsys.readouterr().out
    asked = ["eval", "gap", "--stress", "--rows", "thrust x0.8", "--episodes", "20", "--plots", str(plots)]
    assert run([*asked, "--least", "1.0"]) == 1
    assert "100.0% is asked for" in capsys.readouterr().out


def test_rows_are_numbers_of_one_program() -> None:
    """No row sets a shape: every leaf of every draw has the same shape."""
    import jax

    shapes = {tuple(np.shape(leaf) for leaf in jax.tree.leaves(drawn(row, 5))) for row in ROWS}
    assert len(shapes) == 1


@pytest.mark.parametrize("controller", ["policy", "plant"])
def test_the_rows_change_the_vehicle_that_flies(controller: str, tmp_path: Path) -> None:
    """The nominal row is what `evaluate` flies of another vehicle; the mass of a row is about that vehicle's."""
    heavy = tmp_path / "heavy.toml"
    heavy.write_text(vehicle_file("vis_r").read_text().replace("value = 0.75\n", "value = 0.9\n", 1))
    flies = {"vehicle": str(heavy), "controller": controller}
    plain = e2efly.evaluate("hover_aware", 20, **flies)  # type: ignore[arg-type]
    report = stress("hover_aware", 20, rows=("nominal", "mass x0.8"), **flies)  # type: ignore[arg-type]
    assert (report.as_json()["vehicle"], report.as_json()["controller"]) == (str(heavy), controller)
    a, b, light = (
        float(np.median(found["hover_aware"].final_error))
        for found in (plain.flown, report.flown["nominal"], report.flown["mass x0.8"])
    )
    assert a == pytest.approx(b, abs=2e-3)
    own = stress("hover_aware", 20, rows=("nominal",)).flown["nominal"]["hover_aware"]
    if controller == "policy":  # 0.8 x 0.9 kg is nearly the policy's own 0.75 kg
        assert b > light + 0.02
        assert light == pytest.approx(float(np.median(own.final_error)), abs=0.03)
    else:
        assert light > b + 0.01
