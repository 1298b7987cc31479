"""The parts of the rehearsal of hardware in the loop that need no process."""

import dataclasses
import json
import math
from pathlib import Path

import numpy as np
import pytest

from e2efly.commands.cli import run
from e2efly.commands.hil_rehearsal import told
from e2efly.courses.origin import Origin
from e2efly.courses.tracks import load_track, track_text
from e2efly.flight.pose.json_source import parse_pose
from e2efly.flight.settings import Fence, FlightSettings
from e2efly.validation import rehearse_hil
from e2efly.validation.candidate import candidate
from e2efly.validation.hil_lap import Lap, SceneChange, Spread, Truth, verdict
from e2efly.validation.link_process import DelayLine
from e2efly.validation.mocap_process import ATTITUDE, POSITION, Marks, MocapCamera
from e2efly.validation.processes import NotReadyError, Program, flags
from e2efly.validation.rehearse_hil import LOOP_S, Drawn, RehearsalPlan, draw, unlike

POSE = {"position": [1.0, 2.0, 3.0], "quaternion": [0.6, 0.0, 0.8, 0.0], "velocity": [0, 0, 0], "stamp": 5.0}


def test_motion_capture_is_late_and_noisy_and_tells_no_velocity() -> None:
    camera = MocapCamera(Marks(delay=0.004, gaps=0.0), np.random.default_rng(0))
    for k in range(400):
        camera.see({**POSE, "stamp": 0.005 * k}, now=0.005 * k)
    assert len(camera.ready(2.0)) == 400
    camera.see(POSE, now=9.0)
    assert camera.ready(9.0039) == []
    assert len(camera.ready(9.0051)) == 1
    samples = []
    for k in range(400):
        camera.see(POSE, now=10.0 + k)
        (message,) = camera.ready(10.0051 + k)
        samples.append(parse_pose(message, 0.0))  # the bridge's own reader takes it
    assert all(sample.velocity is None and sample.stamp == 5.0 for sample in samples)
    off = np.array([sample.position for sample in samples]) - POSE["position"]
    np.testing.assert_allclose(off.std(axis=0), POSITION, rtol=0.15)
    turned = np.array([sample.quaternion for sample in samples])
    np.testing.assert_allclose(np.linalg.norm(turned, axis=1), 1.0, atol=1e-9)
    angle = 2 * np.arccos(np.clip(np.abs(turned @ POSE["quaternion"]), 0, 1))
    assert 0.5 * ATTITUDE < np.median(angle) < 3 * ATTITUDE


def test_hidden_markers_deliver_nothing_for_a_moment() -> None:
    camera = MocapCamera(Marks(gaps=2.0), np.random.default_rng(0))
    seen = 0
    for k in range(4000):
        camera.see(POSE, now=0.005 * k)
        seen += len(camera.ready(0.005 * k))
    hidden = 4000 - seen
    assert 40 < hidden < 300  # 40 gaps of 15 ms on average, each three poses or so


def test_a_radio_delivers_late_and_in_order() -> None:
    line = DelayLine(0.05)
    line.send(b"first ", now=1.0)
    line.send(b"second", now=1.01)
    assert line.arrived(1.0499) == b""
    assert line.arrived(1.0501) == b"first "
    assert line.arrived(1.0501) == b""
    line.send(b" third", now=1.02)
    assert line.arrived(1.2) == b"second third"


def test_the_radio_of_a_rehearsal_has_what_the_loop_leaves_of_the_latency() -> None:
    by_radio, on_board = (candidate("race_clutter", vehicle) for vehicle in ("vis_h", "vis_r"))
    assert RehearsalPlan(by_radio).radio == pytest.approx(0.09 - LOOP_S)
    assert RehearsalPlan(on_board).radio == pytest.approx(0.06 - LOOP_S)
    assert RehearsalPlan(by_radio, link_delay=0.0).radio == 0.0


def test_options_of_a_command_are_those_that_differ() -> None:
    assert flags("flight", FlightSettings()) == []
    fence = dataclasses.replace(Fence(), low=(-9.0, -8.5, 0.1))
    settings = dataclasses.replace(FlightSettings(), battery_unknown=True, land_speed=0.6, fence=fence)
    given = ["--flight.land-speed", "0.6", "--flight.battery-unknown", "--flight.fence.low", "-9", "-8.5", "0.1"]
    assert flags("flight", settings) == given


def test_a_track_is_written_as_it_is_read(tmp_path: Path) -> None:
    for name in ("s_shaped", "four_gates"):
        track, file = load_track(name), tmp_path / f"{name}.toml"
        file.write_text(track_text(track))
        again = load_track(str(file))
        assert again.closed == track.closed
        for part in ("start", "start_yaw", "position", "yaw", "opening"):
            np.testing.assert_allclose(getattr(again, part), getattr(track, part), atol=2e-6)


@pytest.fixture(scope="module")
def race(tmp_path_factory: pytest.TempPathFactory) -> tuple[RehearsalPlan, Drawn]:
    plan = RehearsalPlan(candidate("race_clutter"), Origin((2.0, -1.0, 0.0), 0.3))
    return plan, draw(plan, 4, tmp_path_factory.mktemp("drawn") / "track.toml")


@pytest.mark.whole
def test_the_bridge_is_told_the_gates_that_stand_in_the_world(race: tuple[RehearsalPlan, Drawn]) -> None:
    _, drawn = race
    own, wanted = drawn.course.memory, drawn.scenery.course.memory
    own_track, track = own.tracks.track(0), wanted.tracks.track(0)
    for part in ("position", "yaw", "opening", "start"):
        np.testing.assert_allclose(getattr(own_track, part), getattr(track, part), atol=1e-5)
    np.testing.assert_allclose(own.speed, wanted.speed, rtol=1e-6)
    given = flags("goal", drawn.route)
    assert given[given.index("--goal.scale") + 1] == "1"
    np.testing.assert_allclose(np.float32(given[given.index("--goal.speed") + 1]), wanted.speed[0])


def test_a_course_that_the_rooms_fence_does_not_hold_is_refused_with_its_size(
    race: tuple[RehearsalPlan, Drawn], tmp_path: Path
) -> None:
    plan, drawn = race
    with pytest.raises(ValueError, match=rf"the fence is \(-3.0, .* the course needs {drawn.course.needs}; accepted"):
        draw(dataclasses.replace(plan, fence=Fence()), 4, tmp_path / "track.toml")
    low, high = drawn.course.box
    fits = Fence(low=tuple(low), high=tuple(high))
    assert draw(dataclasses.replace(plan, fence=fits), 4, tmp_path / "track.toml").course.needs == drawn.course.needs


def through_gates(drawn: Drawn, aside: float = 0.0) -> Truth:
    """A path straight through the centres of the gates at 5 m/s, in the room."""
    course = drawn.course
    gates = course.memory.tracks.track(0)
    ahead = np.stack([np.cos(gates.yaw), np.sin(gates.yaw), 0 * gates.yaw], axis=-1)
    left = np.stack([-np.sin(gates.yaw), np.cos(gates.yaw), 0 * gates.yaw], axis=-1)
    centres = gates.position + aside * left
    corners = np.concatenate(
        [[course.start], np.stack([centres - 0.3 * ahead, centres + 0.3 * ahead], 1).reshape(-1, 3)]
    )
    way = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(corners, axis=0), axis=1)))
    along = np.arange(0.0, way[-1], 0.02)
    points = course.origin.points(np.stack([np.interp(along, way, corners[:, i]) for i in range(3)], axis=1))
    time, still = 100.0 + along / 5.0, np.tile([1.0, 0, 0, 0], (len(along), 1))
    return Truth(time, points, np.gradient(points, time, axis=0), still, 0 * time)


def test_the_truth_is_judged_in_the_scene(race: tuple[RehearsalPlan, Drawn]) -> None:
    plan, drawn = race
    asked = drawn.course, drawn.scenery
    good = verdict(*asked, through_gates(drawn), 100.0, plan.period, 1e-6)
    assert good.success and good.told.startswith("4 gates in")
    assert good.top_speed == pytest.approx(5.0, rel=0.01)
    wide = verdict(*asked, through_gates(drawn, aside=1.0), 100.0, plan.period, 1e-6)
    assert not wide.success and wide.told.startswith("no gate")
    large = verdict(*asked, through_gates(drawn), 100.0, plan.period, good.nearest + 0.01)
    assert not large.success and "hit something" in large.told


def test_what_is_unlike_the_documented_end_is_told() -> None:
    stale = SceneChange(11.0, "hover", ("policy: image 'image_0': is 134 ms old; accepted: at most 133 ms",))
    whole = Lap(0, "hil", changes=(SceneChange(10.0, "policy", ()), stale), window=(10.0, 11.0), touch_sink=0.6)
    assert unlike(whole) == []
    assert unlike(dataclasses.replace(whole, kill="mocap"))[0].startswith("after the kill came hover (policy: image")
    assert unlike(dataclasses.replace(whole, changes=whole.changes[:1]))[0].startswith("after the kill the bridge")
    fence = SceneChange(10.7, "hover", ("would leave the fence: x would reach 2.81 m; accepted: -2.8 to 2.8",))
    gone = SceneChange(10.8, "land", ("no link to the flight controller: the watchdog process has ended",))
    begun = whole.changes[:1]
    assert unlike(dataclasses.replace(whole, kill="watchdog", changes=(*begun, fence, gone))) == []
    assert "came hover (would" in unlike(dataclasses.replace(whole, kill="watchdog", changes=(*begun, fence)))[0]
    assert "came hover (would" in unlike(dataclasses.replace(whole, changes=(*begun, fence, stale)))[0]
    assert unlike(dataclasses.replace(whole, touch_sink=3.0)) == ["touched the ground sinking at 3.0 m/s"]
    assert not dataclasses.replace(whole, kill=None).good and whole.good
    assert math.isnan(Spread.of([math.nan]).p99) and Spread.of([1.0, 2.0, 3.0]).median == 2.0


def test_a_program_that_fails_tells_its_last_words() -> None:
    with Program("the node", ["-c", "print('one'); raise SystemExit('no images')"]) as node:
        with pytest.raises(NotReadyError, match=r"the node did not come to 'ready'.*no images") as error:
            node.ready("ready", 20.0)
        assert "'one'" in str(error.value)
    assert node.process.poll() is not None


def test_a_lap_for_which_a_process_was_not_ready_was_not_begun_and_counts_as_none(
    race: tuple[RehearsalPlan, Drawn], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with Program("the node", ["-c", "import time; print('compiles'); time.sleep(60)"]) as node:

        def starts(*_: object) -> None:
            node.ready("ready", 1.0)

        monkeypatch.setattr(rehearse_hil, "_Flight", starts)
        lap = rehearse_hil.rehearse(race[0], 4, tmp_path / "flight")
    (problem,) = lap.problems
    assert problem.startswith("the node was not ready within 1 s, in which it had a processor for 0 s: ")
    assert "compiles" in problem
    assert not lap.begun and not lap.good
    said = told([lap, Lap(5, success=True)])
    assert "1 of 1 flights with success." in said
    assert "1 of 2 flights were not begun, and count as none." in said and f"world 4: {problem}" in said


def test_options_without_effect_are_refused(capsys: pytest.CaptureFixture[str]) -> None:
    for given, said in (
        (["avoid", "--laps", "3"], "--laps is 3; accepted: only with --rehearse"),
        (["avoid", "--kill", "hil"], "--kill is hil; accepted: only with --rehearse"),
        (["avoid", "--rehearse", "--pose", "udp:1"], "--pose is udp:1; accepted: left out with --rehearse"),
        (["avoid", "--rehearse", "--pose-delay", "0.5"], "--pose-delay is 0.5; accepted: 0 to 0.2 s"),
        (["avoid", "--rehearse", "--laps", "0"], "--laps is 0; accepted: 1 or more"),
        (
            ["avoid", "--rehearse", "--fence-low", "2.9", "0", "0"],
            "flight.fence.low and flight.fence.high are 2.9 and 3.0",
        ),
        (["hover", "--rehearse"], "policy hover sees nothing; accepted: a policy with images"),
    ):
        assert run(["hil", *given]) == 2
        assert said in " ".join(capsys.readouterr().err.split()), given


def test_a_report_is_json(race: tuple[RehearsalPlan, Drawn]) -> None:
    lap = Lap(3, changes=(SceneChange(1.0, "policy", ("mission switch",)),), truth=through_gates(race[1]))
    assert json.loads(json.dumps(lap.as_json()))["modes"] == [[1.0, "policy", ["mission switch"]]]
