"""Courses: the same on NumPy and on JAX, without JAX, and placed in a room."""

import dataclasses
import os
import subprocess
import sys
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from e2efly.courses import tracks
from e2efly.courses.gates import Gates
from e2efly.courses.origin import Origin
from e2efly.courses.references import Lissajous, Spline, read_csv
from e2efly.courses.tracks import load_track, track_names
from e2efly.environment import random_key
from e2efly.policy.goal import Shape
from e2efly.simulation.scenes import course as _registered  # JAX knows gates by it  # noqa: F401
from e2efly.tasks.track import TrackConfig
from e2efly.tasks.track.splines import polynomial
from e2efly.tasks.track.world import Track

CURVES = [Lissajous.circle(2.0, 0.2 * np.pi), Lissajous.lemniscate(2.0, 3.0)]


@pytest.mark.parametrize("curve", CURVES)
def test_a_curve_is_the_same_on_both_libraries(curve: Lissajous) -> None:
    phase = np.array([-2.0, 0.3, 3.0], np.float32)
    ours, theirs = (curve.spline((1.0, -1.0, 3.0), x, 23).knots for x in (phase, jnp.asarray(phase)))
    assert (type(ours), ours.shape) == (np.ndarray, (3, 23, 3, 3))
    assert isinstance(theirs, jax.Array)
    np.testing.assert_allclose(ours, theirs, atol=3e-5)


@pytest.mark.usefixtures("x64")
def test_a_spline_is_the_same_on_both_libraries() -> None:
    """Between the knots, on them, before the first and behind the end, also while JAX traces."""
    random = polynomial(random_key(0), (0.0, 0.0, 3.0), 2.0, 2.5, 4, 23)
    spline = Spline(np.asarray(random.knots), end=9.7)
    time = np.stack([np.linspace(-1, 12, 300), np.arange(300) * 0.5, np.full(300, 9.7), np.full(300, 0.0)])
    ours, theirs = spline.position(time), jax.jit(lambda s, t: s.position(t))(spline, jnp.asarray(time))
    assert (type(ours), ours.shape) == (np.ndarray, (4, 300, 3))
    np.testing.assert_allclose(ours, theirs, atol=1e-12)
    np.testing.assert_array_equal(ours[0, 0], spline.knots[0, 0, 0])
    assert spline.duration == 9.7
    np.testing.assert_array_equal(ours[2, 0], spline.position(np.full((4, 1), 50.0))[2, 0])


@pytest.mark.usefixtures("x64")
@pytest.mark.parametrize("name", track_names())
def test_gates_are_judged_alike_on_both_libraries(name: str) -> None:
    """Steps of any length about the gates, with passes, misses and blows among them."""
    rng = np.random.default_rng(0)
    track = load_track(name)
    gates = Gates.of(track)
    n = 4000
    index = rng.integers(0, gates.count, n)
    middle = track.position[index] + rng.uniform(-0.8, 0.8, (n, 3))
    step = rng.normal(0.0, 0.5, (n, 3))
    ours = gates.judge(index, middle - step, middle + step, 0.12)
    theirs = jax.jit(lambda g, *args: g.judge(*args))(gates, index, middle - step, middle + step, 0.12)
    for a, b in zip(ours, theirs, strict=True):
        assert isinstance(a, np.ndarray)
        assert 50 < a.sum() < n - 50
        np.testing.assert_array_equal(a, b)


def test_an_origin_turns_then_moves() -> None:
    origin = Origin((10.0, 20.0, 1.0), np.pi / 2)
    np.testing.assert_allclose(origin.points((1.0, 2.0, 3.0)), [8.0, 21.0, 4.0], atol=1e-12)
    np.testing.assert_allclose(origin.vectors(np.array([[1.0, 0.0, 0.0]])), [[0.0, 1.0, 0.0]], atol=1e-12)


@pytest.mark.parametrize("name", track_names())
def test_a_placed_track_is_flown_by_the_placed_flight(name: str) -> None:
    origin, track, rng = Origin((3.0, -1.0, 0.2), -2.0), load_track(name), np.random.default_rng(1)
    n, count = 500, len(track.position)
    index = rng.integers(0, count, n)
    middle = track.position[index] + rng.uniform(-0.8, 0.8, (n, 3))
    step = rng.normal(0.0, 0.5, (n, 3))
    here = Gates.of(track).judge(index, middle - step, middle + step, 0.12)
    a, b = origin.points(middle - step), origin.points(middle + step)
    there = Gates.of(origin.track(track)).judge(index, a, b, 0.12)
    np.testing.assert_array_equal(here, there)
    placed = origin.track(track)
    assert dataclasses.replace(placed, start=0, position=0, yaw=0, start_yaw=0.0) == dataclasses.replace(
        track, start=0, position=0, yaw=0, start_yaw=0.0
    )
    assert placed.start_yaw == pytest.approx(track.start_yaw - 2.0)


BROKEN_TRACKS = [
    ("closed = true", "closed = 1", "closed is 1; accepted: true or false"),
    ("closed = true", "closed = [true]", r"closed is \[True\]; accepted: true or false"),
    ("closed = true", "closed =", "not a TOML file"),
    ("closed = true\n", "", "the file has"),
    ("gates = [", "gates = 3\nother = [", "the file has"),
    ("opening = [1.0, 1.0] },\n]", "opening = [0.2, 1.0] },\n]", r"gates\[3\].opening is \[0.2, 1.0\]"),
    ("opening = [1.0, 1.0]", "opening = 1.0", r"gates\[0\].opening is 1.0; accepted: 2 finite"),
    ("[4.0, 4.0, 1.0]", "[4.0, nan, 1.0]", r"gates\[0\].position is"),
    ("[4.0, 4.0, 1.0]", "[4.0, 4.0, 0.2]", "an opening above the ground"),
    ("position = [4.0, 4.0, 1.0], yaw = 0.0,", "yaw = 0.0,", r"gates\[0\] has \['opening', 'yaw'\]"),
    ("yaw = -86.0", 'yaw = "east"', r"gates\[1\].yaw is 'east'; accepted: a finite number"),
    ("yaw = -86.0", "yaw = inf", r"gates\[1\].yaw is inf; accepted: a finite number"),
    ("[0.0, 0.0, 1.5]", "[0.0, 0.0]", r"start.position is \[0.0, 0.0\]; accepted: 3 finite"),
    ("[0.0, 0.0, 1.5]", "[1e30, 0.0, 1.5]", "start.position is .*at most 10000 in size"),
    ("yaw = 45.0", "yow = 45.0", "start has"),
    ("yaw = 45.0", "yaw = true", r"start.yaw is True"),
    ("yaw = 45.0", "yaw = 1e308", "yaw is 1e.308; accepted: a finite number, at most 10000 in size"),
    ("yaw = 45.0", "yaw = 1" + "0" * 400, r"yaw is 1000.*\.\.\.; accepted: a finite number"),
]


@pytest.mark.parametrize(("old", "new", "told"), BROKEN_TRACKS)
def test_broken_tracks_are_named(old: str, new: str, told: str, tmp_path: Path) -> None:
    text, file = (Path(tracks.__file__).parent / "four_gates.toml").read_text(), tmp_path / "mine.toml"
    file.write_text(text)
    assert load_track(str(file)).name == "mine"
    assert load_track(str(file)).start_yaw == pytest.approx(np.pi / 4)
    assert old in text
    file.write_text(text.replace(old, new, 1))
    with pytest.raises(ValueError, match=f"mine.toml: .*{told}"):
        load_track(str(file))


HEAD = "t,x,y,z\n"


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", "line 1: empty"),
        ("time,x,y,z\n", "line 1"),
        (HEAD + "0,0,0,1\n1,0,0,1\n", "2 rows"),
        (HEAD + "0,0,0,1\n0,0,0,1\n2,0,0,1\n", "line 3"),
        (HEAD + "0,0,0,1\n1,nan,0,1\n2,0,0,1\n", "line 3"),
        (HEAD + "0,0,0,1\n1,0,1\n2,0,0,1\n", "line 3"),
        (HEAD + "0,0,0,0\n1,0,0,1\n2,0,0,1\n", "lowest z is 0.0 m"),
        (HEAD + "0,0,0,1\n1,0,0,1\n1e12,0,0,1\n", "line 4: .*over at most 3600 s"),
        (HEAD + "0,0,0,1\n1,1e30,0,1\n2,0,0,1\n", "line 3: .*at most 10000 in size"),
        (HEAD + "0,0,0,1\n1e-300,1,0,1\n2e-300,1,0,1\n", "line 3: .*by at least 0.001 s"),
        (HEAD + "0,0,0," + "1" * 200_000, "cannot be read: field larger than field limit"),
        (HEAD + "0,0,0,nan\n1,0,0,1\n2,0,0,1\n", "line 2: "),
    ],
)
def test_a_reference_that_cannot_be_flown_is_refused(text: str, told: str, tmp_path: Path) -> None:
    (tmp_path / "way.csv").write_text(text)
    with pytest.raises(ValueError, match=rf"way.csv.*{told}"):
        Track.of(TrackConfig(reference=str(tmp_path / "way.csv")), Shape(0.05, 0.12))


def test_a_reference_with_a_byte_order_mark(tmp_path: Path) -> None:
    (tmp_path / "way.csv").write_text("t,x,y,z\n0,0,0,1\n1,0,0,1\n2,0,0,1\n", encoding="utf-8-sig")
    assert read_csv(tmp_path / "way.csv").shape == (3, 4)


def test_courses_need_no_jax() -> None:
    code = "import sys; from e2efly.courses import defaults, gates, origin, references, tracks; print(*sys.modules)"
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    out = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    loaded = out.stdout.split()
    assert {name.split(".")[1] for name in loaded if name.startswith("e2efly.")} == {"config", "courses"}
    assert not {"jax", "jaxlib", "jaxtyping", "scipy"} & set(loaded)
