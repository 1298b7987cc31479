"""Poses from gates: corners in masks, where they are expected, and the filter, each against an independent judge."""

import dataclasses
import itertools
import re
import time
from pathlib import Path

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from e2efly.courses.tracks import load_track
from e2efly.flight.pose.gates.association import associated
from e2efly.flight.pose.gates.error_state import SIZE, AssumedNoise, ErrorState, quaternion_of, rotation_of, turned
from e2efly.flight.pose.gates.gate_estimator import GateEstimator, InertialSample
from e2efly.flight.pose.gates.gate_setup import GateSetup, load_setup
from e2efly.flight.pose.gates.gate_source import GateSource
from e2efly.flight.pose.gates.lens import Corners, Lens, Openings
from e2efly.flight.pose.pose_source import AidedSource
from e2efly.flight.pose.sources import open_source
from e2efly.flight.sight.gate_corners import gate_corners

LENS = Lens(640, 360, (1.5, 1.0), -0.3, (0.1, 0.02, 0.03), 0.016)
TRACK = load_track("s_shaped")
OPENINGS = Openings.of(TRACK, 0.05)
RANDOM = np.random.default_rng(3)
START = ErrorState.at(0.0, np.array([1.0, 0.3, 1.4]), turned(np.array([0.1, 0.2, 0.1])), AssumedNoise())
MOVING = dataclasses.replace(
    START, velocity=np.array([4.0, -1.0, 0.5]), body_rate=np.array([1.0, -2.0, 0.5]), offset=0.01,
    mounting=turned(np.array([0.02, -0.01, 0.03])),
)  # fmt: skip
EYE = """
track = "four_gates"
start = [0.0, 0.0, 0.1, 45.0]
[camera]
width = 640
height = 360
fov = [90.0, 58.7]
pitch = -20.0
rate = 30.0
"""


def drawn(*corners: tuple[float, float]) -> np.ndarray:
    """A mask with a gate whose opening has these corners, clockwise in the image: the pixels whose middle is on it."""
    inner = np.array(corners)
    outer = inner.mean(0) + 1.3 * (inner - inner.mean(0))
    x, y = np.meshgrid(np.arange(640) + 0.5, np.arange(360) + 0.5)

    def within(polygon: np.ndarray) -> np.ndarray:
        ways = np.roll(polygon, -1, axis=0) - polygon
        sides = zip(polygon, ways, strict=True)
        return np.all([way[0] * (y - p[1]) - way[1] * (x - p[0]) > 0 for p, way in sides], axis=0)

    return (within(outer) & ~within(inner)).astype(np.uint8)


def test_corners_of_openings_are_found_to_half_a_pixel() -> None:
    corners = np.array([[200.3, 90.8], [330.6, 120.2], [322.1, 262.7], [190.9, 240.4]])
    found = gate_corners(drawn(*corners))
    assert len(found.pixel) == 4  # and none of the four outside
    for corner in corners:
        k = int(np.argmin(np.linalg.norm(found.pixel - corner, axis=1)))
        assert np.linalg.norm(found.pixel[k] - corner) < 0.5
        assert found.inward[k] @ (corners.mean(0) - corner) > 0


def test_corners_that_a_network_has_rounded_are_where_the_sides_meet() -> None:
    corners = np.array([[200.3, 90.8], [330.6, 120.2], [322.1, 262.7], [190.9, 240.4]])
    soft = cv2.GaussianBlur(drawn(*corners).astype(np.float32), (0, 0), 7.0)
    found = gate_corners((soft > 0.5 * soft.max()).astype(np.uint8))
    assert len(found.pixel) == 4
    away = np.linalg.norm(found.pixel[:, None] - corners[None], axis=-1).min(axis=0)
    assert away.max() < 1.5


def test_a_gate_that_is_half_out_of_the_image_gives_the_corners_that_are_in_it() -> None:
    found = gate_corners(drawn((-80, 100), (90, 100), (90, 250), (-80, 250)))
    assert len(found.pixel) == 2
    np.testing.assert_allclose(sorted(found.pixel[:, 1]), [100, 250], atol=0.5)


@pytest.mark.parametrize("mask", [np.zeros((40, 60)), np.ones((40, 60)), np.eye(40)])
def test_masks_without_an_opening_have_no_corners(mask: np.ndarray) -> None:
    assert len(gate_corners(mask).pixel) == 0


def test_expected_corners_are_those_of_what_both_faces_of_a_gate_leave_open() -> None:
    """The judge is OpenCV's intersection of the two openings, front and back, as a camera sees them."""
    for eye in ([-2.0, 0.2, 1.2], [0.5, 1.9, 1.0], [2.5, -1.2, 2.6]):
        points, _ = OPENINGS.seen(np.array(eye))
        for gate, middle in enumerate(TRACK.position):
            ahead = middle - eye
            if abs(ahead @ OPENINGS.forward[gate]) < 0.05 * 0.5 * np.linalg.norm(ahead):
                continue  # seen from the edge
            axes = Rotation.align_vectors([[0, 0, 1.0]], [ahead / np.linalg.norm(ahead)])[0].as_matrix()

            def image(where: np.ndarray, axes: np.ndarray = axes, eye: list[float] = eye) -> np.ndarray:
                there = (where - eye) @ axes.T
                return (1000 * there[:, :2] / there[:, 2:]).astype(np.float32)

            faces = [image(OPENINGS.corners[gate] + side * OPENINGS.forward[gate]) for side in (1, -1)]
            area, open_ = cv2.intersectConvexConvex(*faces)
            assert area > 0
            for corner in image(points[gate]):
                assert np.linalg.norm(open_[:, 0] - corner, axis=1).min() < 0.05


def test_the_slope_of_the_expected_pixels_is_that_of_finite_differences() -> None:
    """Of gates without depth and a shutter that opens at once: the filter leaves out what these add to the slope."""
    lens, openings = dataclasses.replace(LENS, readout=0.0), Openings.of(TRACK, 0.0)
    expected, _ = MOVING._expected(lens, openings)
    assert len(expected.pixel) >= 4
    for k in range(SIZE):
        error = np.zeros(SIZE)
        error[k] = 1e-6
        ends = [MOVING._with(sign * error, MOVING.covariance)._expected(lens, openings)[0].pixel for sign in (1, -1)]
        np.testing.assert_allclose(expected.slope[:, :, k], (ends[0] - ends[1]) / 2e-6, atol=1e-3, rtol=1e-4)


def test_the_covariance_moves_as_the_errors_do() -> None:
    """Many states that differ by small errors are moved; the spread of where they arrive is the covariance."""
    noise = AssumedNoise(gyro=1e-12, accel=1e-12, gyro_walk=1e-12, accel_walk=1e-12)
    small = dataclasses.replace(MOVING, covariance=1e-6 * np.diag(RANDOM.uniform(0.5, 2, SIZE)))
    gyro, force = np.array([1.2, -2.2, 0.4]), np.array([2.0, 1.0, 14.0])
    after = small.moved(gyro, force, 0.01, noise)
    columns = []
    for k in range(SIZE):
        error = np.zeros(SIZE)
        error[k] = 1e-5
        other = small._with(error, small.covariance).moved(gyro, force, 0.01, noise)
        turn = Rotation.from_matrix(after.rotation.T @ other.rotation).as_rotvec()
        shift = np.concatenate([
            other.position - after.position, other.velocity - after.velocity, turn,
            other.gyro_bias - after.gyro_bias, other.accel_bias - after.accel_bias, np.zeros(4),
        ])  # fmt: skip
        shift[15:] = error[15:]
        columns.append(shift / 1e-5)
    step = np.array(columns).T
    np.testing.assert_allclose(after.covariance, step @ small.covariance @ step.T, atol=5e-9)


def test_quaternions_and_rotations_are_those_of_scipy() -> None:
    for vector in RANDOM.uniform(-3, 3, (20, 3)):
        matrix = Rotation.from_rotvec(vector).as_matrix()
        np.testing.assert_allclose(turned(vector), matrix, atol=1e-12)
        np.testing.assert_allclose(rotation_of(quaternion_of(matrix)), matrix, atol=1e-12)


def seen_from(state: ErrorState, readout: bool = False) -> Corners:
    """The corners that a camera of the lens sees, by SciPy's rotations, one after the other."""
    pixels, inward = [], []
    points, _ = OPENINGS.seen(state.position)
    view = Rotation.from_matrix(np.array([[0, -1.0, 0], [0, 0, -1], [1, 0, 0]])) * Rotation.from_euler("y", -LENS.pitch)
    for gate in points:
        body = (gate - state.position) @ state.rotation - np.array(LENS.position)
        ahead = view.apply(body)
        if np.any(ahead[:, 2] < 0.5):
            continue
        half = np.array([320, 180]) / np.tan(np.array(LENS.fov) / 2)
        flat = np.array([320, 180]) + half * ahead[:, :2] / ahead[:, 2:]
        for corner in flat:
            if np.all((corner > 4) & (corner < [636, 356])):
                way = flat.mean(0) - corner
                pixels.append(corner)
                inward.append(way / np.linalg.norm(way))
    return Corners(np.array(pixels).reshape(-1, 2), np.array(inward).reshape(-1, 2))


def test_gates_in_a_row_are_told_apart_from_half_a_metre_off() -> None:
    """Nearest neighbours would be wrong here: each gate lies nearly where another one is expected."""
    lens = dataclasses.replace(LENS, readout=0.0)
    truth = dataclasses.replace(START, position=np.array([-1.0, 0.0, 1.5]), rotation=turned(np.array([0, 0.2, 0.0])))
    found = seen_from(truth)
    assert len(found.pixel) >= 8
    for shift in ([0.4, 0.3, 0.1], [-0.3, 0.4, -0.2], [0.2, -0.5, 0.1]):
        noise = AssumedNoise(start=(0.4, 0.1, 0.05), mounting=0.002, offset=1e-3)
        off = ErrorState.at(0.0, truth.position + shift, truth.rotation @ turned(np.array([0.02, -0.03, 0.04])), noise)
        told, used = off.corrected(found, lens, OPENINGS, noise)
        assert used >= 6
        assert np.linalg.norm(told.position - truth.position) < 0.15 < np.linalg.norm(shift)


def test_corners_that_fit_nowhere_change_no_position_and_raise_the_doubt() -> None:
    found = Corners(np.array([[20.0, 300.0], [600.0, 30.0]]), np.array([[1.0, 0.0], [-1.0, 0.0]]))
    small = dataclasses.replace(START, covariance=1e-4 * START.covariance)
    told, used = small.corrected(found, LENS, OPENINGS, AssumedNoise())
    assert used == 0
    np.testing.assert_array_equal(told.position, small.position)
    assert told.covariance[0, 0] > small.covariance[0, 0]


def test_an_ambiguous_corner_is_left_out() -> None:
    expected, _ = MOVING._expected(LENS, OPENINGS)
    between = expected.pixel[:2].mean(0)[None]
    wide = MOVING.covariance * 100
    assert associated(expected, wide, between, np.ones((len(expected.pixel), 1), bool), 3.0) == []


def flown(offset: float, mounting: float, seconds: float = 12.0) -> tuple[list[float], GateEstimator]:
    """A vehicle that sways in front of gates, whose camera is late and turned; the errors of the estimate, m."""
    noise = AssumedNoise()
    lens = dataclasses.replace(LENS, readout=0.0)
    turn = turned(np.array([mounting, -mounting, mounting]) / np.sqrt(3))

    def truth(t: float) -> ErrorState:
        place = np.array([-1 + 0.8 * np.sin(2 * t), 0.8 * np.sin(1.7 * t), 1.5 + 0.3 * np.sin(2.6 * t)])
        angles = np.array([0.2 * np.sin(2 * t), 0.15 + 0.15 * np.sin(1.3 * t), 0.2 * np.sin(1.1 * t)])
        return dataclasses.replace(START, position=place, rotation=Rotation.from_rotvec(angles).as_matrix())

    estimator = GateEstimator(
        ErrorState.at(0.0, truth(0).position + 0.1, truth(0).rotation, noise), lens, OPENINGS, noise
    )
    random, h, errors = np.random.default_rng(0), 1e-4, []
    bias = np.array([0.2, -0.1, 0.15]), np.array([0.01, -0.02, 0.01])
    for k in range(1, int(250 * seconds)):
        t = k / 250
        now, before, after = truth(t), truth(t - h), truth(t + h)
        rate = Rotation.from_matrix(before.rotation.T @ after.rotation).as_rotvec() / (2 * h)
        pull = (after.position - 2 * now.position + before.position) / h**2 + [0, 0, 9.80665]
        estimator.feel(InertialSample(
            t, rate + bias[1] + 0.02 * random.standard_normal(3),
            now.rotation.T @ pull + bias[0] + 0.3 * random.standard_normal(3),
        ))  # fmt: skip
        if k % 8 == 0:  # exposed 40 ms ago, and stamped wrongly
            exposed = truth(t - 0.04)
            found = seen_from(dataclasses.replace(exposed, rotation=exposed.rotation @ turn))
            pixel = found.pixel + random.standard_normal(found.pixel.shape)
            estimator.look(Corners(pixel, found.inward), t - 0.04 - offset)
        errors.append(float(np.linalg.norm(estimator.state.position - now.position)))
    return errors, estimator


def test_a_camera_that_is_late_and_askew_is_found_out() -> None:
    errors, estimator = flown(offset=0.02, mounting=0.035)
    assert np.sqrt(np.mean(np.square(errors[2000:]))) < 0.06
    assert estimator.state.offset == pytest.approx(0.02, abs=0.008)
    tilt = np.linalg.norm(Rotation.from_matrix(estimator.state.mounting).as_rotvec())
    assert tilt == pytest.approx(0.035, abs=0.012)


class Nothing:
    """A camera without images."""

    problem: str | None = "the lens cap is on"

    def read(self, now: float) -> list[tuple[float, Corners]]:
        del now
        return []

    def close(self) -> None: ...

    def describe(self) -> str:
        return "a camera"


def setup_of(track: str = "four_gates") -> GateSetup:
    return GateSetup(load_track(track), np.array([0, 0, 0.1, 0.8]), LENS, 30.0, 0.03)


def test_a_source_that_sees_nothing_stops_and_says_why() -> None:
    source, told = GateSource(setup_of(), Nothing()), []
    assert isinstance(source, AidedSource)
    assert source.read(0.0) == []
    assert "IMU has not been heard" in (source.problem or "")
    for k in range(2000):
        source.feel(0.01 * k, np.zeros(3), np.array([0.1, 0.0, 9.9]), standing=k < 500)
        told += source.read(0.01 * k)
    assert 550 < len(told) < 900
    assert "no gate" in source.problem.lower() and "lens cap" in source.problem  # type: ignore[union-attr]
    doubt = np.linalg.norm(told[-1].position - np.array([0, 0, 0.1]))
    assert doubt < 1.0  # it stops before it is far off


def test_a_vehicle_that_stands_stays_where_it_is_for_a_minute() -> None:
    source = GateSource(setup_of(), Nothing())
    bias = np.array([0.02, -0.01, 0.01])
    for k in range(6000):
        source.feel(0.01 * k, bias, np.array([0.1, 0.0, 9.9]), standing=True)
    (sample,) = source.read(60.0)
    assert np.linalg.norm(sample.position - [0, 0, 0.1]) < 0.05
    np.testing.assert_allclose(sample.velocity, 0, atol=0.05)
    np.testing.assert_allclose(source.estimator.state.gyro_bias, bias, atol=2e-3)  # type: ignore[union-attr]


def test_after_a_pause_of_the_imu_in_flight_there_are_no_poses_until_it_stands() -> None:
    source = GateSource(setup_of(), Nothing())
    for at in (0.0, 0.01, 0.02, 0.5, 0.51, 0.52):
        source.feel(at, np.zeros(3), np.array([0, 0, 9.8]), standing=at == 0.0)
        assert len(source.read(at)) == (at < 0.5)
        if at == 0.5:
            assert "silent for 0.48 s" in (source.problem or "")
    source.feel(0.53, np.zeros(3), np.array([0, 0, 9.8]), standing=True)
    assert len(source.read(0.53)) == 1


def test_a_vehicle_that_is_carried_does_not_learn_that_it_stands() -> None:
    source = GateSource(setup_of(), Nothing())
    for k in range(300):
        source.feel(0.01 * k, np.array([0.0, 0.0, 0.8 * (k > 100)]), np.array([0, 0, 9.8]), standing=True)
    assert np.linalg.norm(source.estimator.state.gyro_bias) < 0.05  # type: ignore[union-attr]


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ('track = "four_gates"', "accepted: track"),
        (EYE.replace("fov = [90.0, 58.7]", "fov = [190.0, 58.7]"), "camera.fov is [190.0, 58.7]; accepted"),
        (EYE.replace("width = 640", "width = 640.5"), "camera.width is 640.5; accepted: a whole number of pixels"),
        (EYE.replace("height = 360", "height = 31"), "camera.height is 31; accepted: 32 to 4096"),
        (EYE.replace("rate = 30.0", "rate = 0"), "camera.rate is 0; accepted: 1 to 500"),
        (EYE.replace("rate = 30.0", "rate = 30.0\nlens = 2"), "camera is"),
        (EYE.replace("four_gates", "moon"), "moon"),
        (EYE + "[noise]\npixel = -1.0", "noise.pixel is -1.0; accepted: more than 0"),
        (EYE + "[noise]\npixels = 1.0", "accepted: gyro, accel"),
    ],
)
def test_wrong_files_are_refused_by_name(tmp_path: Path, wrong: str, said: str) -> None:
    file = tmp_path / "eye.toml"
    file.write_text(wrong)
    with pytest.raises(ValueError, match=re.escape(said)):
        load_setup(file)


def test_a_real_process_finds_the_corners(tmp_path: Path) -> None:
    """`gates:` with an image source of one's own, whose process draws a gate: the corners of it arrive."""
    eye, images = tmp_path / "eye.toml", tmp_path / "images.py"
    eye.write_text(EYE)
    images.write_text(
        "import numpy as np\n"
        "from e2efly.flight.sight.image_source import Frame\n"
        "class Drawn:\n"
        "    problem = None\n"
        "    def __init__(self, where, image):\n"
        "        self.image, self.next = image, 0.0\n"
        "    def read(self, now):\n"
        "        if now < self.next: return []\n"
        "        self.next = now + 0.03\n"
        "        mask = np.zeros((self.image.height, self.image.width))\n"
        "        mask[80:280, 200:400] = 1\n"
        "        mask[100:260, 220:380] = 0\n"
        "        return [Frame(now, mask)]\n"
        "    def close(self): pass\n"
        "    def describe(self): return 'drawn'\n"
    )
    source = open_source(f"gates:{eye}@{images}:Drawn")
    try:
        assert isinstance(source, GateSource)
        end, found = time.monotonic() + 10, []
        while not found and time.monotonic() < end:
            found = source._looks.read(time.monotonic())
            time.sleep(0.01)
        stamp, corners = found[0]
        assert time.monotonic() - 5 < stamp < time.monotonic()
        wanted = sorted(itertools.product((220.0, 380.0), (100.0, 260.0)))
        np.testing.assert_allclose(sorted(map(tuple, corners.pixel)), wanted, atol=0.1)
        assert "drawn" in source.describe()
    finally:
        source.close()


@pytest.mark.parametrize("text", ["gates:", "gates:eye.toml", "gates:@shm:mask"])
def test_a_text_that_lacks_a_part_is_refused_with_the_form(text: str) -> None:
    with pytest.raises(ValueError, match=r"gates:EYE\.toml@IMAGE_URI"):
        open_source(text)
