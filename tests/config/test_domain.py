"""What a policy was trained for: measured by hand, drawn by training, declared by contracts, checked before flight."""

import dataclasses
import json
import math
from pathlib import Path

import jax
import numpy as np
import pytest

from e2efly.config import TaskConfig
from e2efly.config.domain import Domain, Extent, outside, track_domain, union
from e2efly.courses.defaults import ROOMS
from e2efly.courses.gates import Tracks
from e2efly.courses.random_tracks import CLUTTERED, RACING, TrackStyle, random_tracks
from e2efly.courses.tracks import RaceTrack, load_track, track_names
from e2efly.policy.contract import Contract
from e2efly.policy.goal import Shape
from e2efly.policy.loader import load_policy
from e2efly.policy.zoo import FOLDER, config_file
from e2efly.runs import presets
from e2efly.runs.inputs import from_json
from e2efly.tasks import TASKS
from e2efly.tasks.race.any_world import displaced
from e2efly.tasks.race.goal import RaceRoute
from e2efly.tasks.race_clutter import RaceClutterConfig
from e2efly.tasks.race_clutter.world import RaceClutter
from e2efly.tasks.route import ANYWAY, UNDECLARED, course_for, goal_notes, route_of
from e2efly.tasks.track import TrackConfig
from e2efly.tasks.track.splines import polynomial
from e2efly.validation.candidate import candidate
from e2efly.vehicles.loading import load_vehicle

VEHICLE = load_vehicle("vis_r")


def track(**changes: object) -> RaceTrack:
    """Two gates 5 m apart, the second 3 m higher and turned to the left by a quarter turn."""
    own = RaceTrack(
        "two", False, np.array([-2.0, 0.0, 1.0]), 0.0, np.array([[0.0, 0.0, 1.0], [0.0, 4.0, 4.0]]),
        np.array([0.0, math.pi / 2]), np.array([[1.0, 2.0], [0.5, 2.0]]),
    )  # fmt: skip
    return dataclasses.replace(own, **changes)  # type: ignore[arg-type]


def test_the_quantities_of_a_track_by_hand() -> None:
    found = {part.name: (part.low, part.high) for part in track_domain(track())}
    quarter = pytest.approx((math.pi / 2, math.pi / 2), abs=1e-6)
    assert found == {
        "gates": (2, 2), "gate_width": (0.5, 1), "gate_height": (2, 2), "gate_altitude": (1, 4),
        "gate_distance": (5, 5), "gate_rise": (3, 3), "gate_bearing": quarter, "gate_turn": quarter,
        "start_distance": (2, 2),
    }  # fmt: skip
    home = {part.name: (part.low, part.high) for part in track_domain(track(closed=True))}
    assert home["gate_rise"] == (-3, 3) and home["gate_bearing"] == pytest.approx((math.pi / 2, math.pi), abs=1e-6)


def test_outside_names_quantity_value_and_range_and_leaves_room_for_placing() -> None:
    trained = track_domain(track())
    assert outside(trained, trained) == ()
    moved = track(position=np.array([[0.0, 0.0, 1.05], [0.0, 4.05, 4.0]]))
    assert outside(trained, track_domain(moved)) == ()
    narrow = track_domain(track(opening=np.array([[1.0, 2.0], [0.4, 2.0]])))
    assert outside(trained, narrow) == ("gate_width is 0.4 to 1 m; trained for 0.5 to 1 m",)
    both = union([trained, narrow])
    assert next(part for part in both if part.name == "gate_width") == Extent("gate_width", "m", 0.4, 1.0)
    assert outside(both, narrow) == outside((), narrow) == ()
    assert outside((Extent("gates", "1", 3, 12),), trained) == ("gates is 2; trained for 3 to 12",)


@pytest.mark.parametrize("style", [RACING, CLUTTERED])
def test_random_tracks_and_those_of_the_package_lie_in_their_domain(style: TrackStyle) -> None:
    tracks: Tracks = random_tracks(np.random.default_rng(5).random((400, *style.numbers())), style)
    reasons = [outside(style.domain, track_domain(tracks.track(i))) for i in range(400)]
    assert all("gate_distance" in reason for reason in sum(reasons, ()))  # of the few that are not clear
    assert sum(map(bool, reasons)) <= 8
    for name in set(track_names()) - set(ROOMS):  # those of rooms have shorter legs
        assert style is CLUTTERED or outside(style.domain, track_domain(load_track(name))) == ()


def test_displaced_gates_lie_in_the_domain_of_their_task() -> None:
    config = RaceClutterConfig()
    world = RaceClutter.of(config, Shape(0.1, 0.2), 0.02, 1)
    drawn = displaced(jax.random.key(3), 100, world.given, config.gate_position, config.gate_yaw, chance=world.chance)
    tracks = jax.tree.map(np.asarray, drawn)
    for i in range(100):
        assert outside(config.domain(), track_domain(tracks.track(i))) == ()


def test_random_references_lie_in_the_domain_of_their_task() -> None:
    config = TrackConfig()
    drawn = polynomial(jax.random.key(1), config.centre, config.polynomial_reach, config.polynomial_speed, 500, 23, 4)
    assert outside(config.domain(), drawn.domain) == ()
    circle = TrackConfig(reference="circle", radius=2.0, circle_rate=-1.5).domain()
    assert [part.high for part in circle] == pytest.approx([3.0, 4.5], rel=1e-3)
    fast = TrackConfig(reference="lemniscate", lemniscate_speed=6.0).domain()
    assert outside(config.domain(), fast)[0] == "reference_speed is 0 to 6 m/s; trained for 0 to 4.688 m/s"


@pytest.mark.parametrize("name", TASKS)
def test_what_every_task_is_judged_by_and_flies_lies_in_its_training(name: str) -> None:
    trained = presets.preset(name, "ppo").task
    domain = trained.domain()
    assert domain is not None
    for suite in trained.criteria().values():
        assert outside(domain, suite.domain() or ()) == ()
    known = name if (FOLDER / "vis_r" / f"{name}.onnx").is_file() else "hover"  # the zoo has no policy of some tasks
    contract = load_policy(FOLDER / "vis_r" / f"{known}.onnx").contract
    contract = dataclasses.replace(contract, task=name, courses=domain)
    assert outside(domain, route_of(contract)().domain()) == ()


@pytest.mark.parametrize("file", sorted(FOLDER.glob("*/*.onnx")), ids=lambda file: f"{file.parent.name}/{file.stem}")
def test_every_policy_of_the_zoo_declares_its_training(file: Path) -> None:
    config = from_json(json.loads(config_file(file).read_text()), str(file))
    assert load_policy(file).contract.courses == (*config.task.domain(), *config.env.payload.domain())


def narrow(path: object) -> str:
    file = str(path)
    with open(file, "w") as out:  # noqa: PTH123
        out.write(
            "closed = true\nstart = { position = [-3, 0, 1.5], yaw = 0 }\ngates = [\n"
            "{ position = [0, 0, 1.5], yaw = 0, opening = [0.4, 0.8] },\n"
            "{ position = [0.75, 0, 1.5], yaw = 0, opening = [0.8, 0.8] },\n"
            "{ position = [3, 3, 1.5], yaw = 180, opening = [0.8, 0.8] }]\n"
        )
    return file


def test_a_course_outside_of_the_training_is_refused_in_flight_unless_it_is_meant(tmp_path: object) -> None:
    contract, file = load_policy("race_any").contract, narrow(f"{tmp_path}/narrow.toml")
    reasons = (
        "gate_width is 0.4 to 0.8 m; trained for 0.6 to 1.5 m",
        "gate_distance is 0.75 to 4.243 m; .* 1.6 to 50 m",
    )
    for reason in (*reasons, ANYWAY.replace("(", "\\(").replace(")", "\\)")):
        with pytest.raises(ValueError, match=reason):
            course_for(contract, VEHICLE, RaceRoute(track=file))
    meant = RaceRoute(track=file, outside=True)
    assert course_for(contract, VEHICLE, meant).goal is not None
    assert [note.partition(":")[0] for note in goal_notes(contract, meant)] == ["Outside of the training"] * 2
    old = dataclasses.replace(contract, courses=None)
    assert course_for(old, VEHICLE, RaceRoute(track=file)).goal is not None
    assert goal_notes(old, None) == [UNDECLARED]
    specialist = load_policy("race").contract
    with pytest.raises(ValueError, match="gates is 6; trained for 4"):
        course_for(specialist, VEHICLE, RaceRoute(track="circle_3d"))


def test_an_evaluation_says_what_lies_outside(tmp_path: object) -> None:
    found = candidate("race_any", task={"track": narrow(f"{tmp_path}/narrow.toml")})
    assert len(found.outside) == 2 and f"Outside of the training: {found.outside[0]}." in found.notes
    assert candidate("race_any").outside == candidate("avoid").outside == []
    assert candidate("avoid", task={"speed": (12.0, 12.0), "forest.density": 0.2, "forest.room": 128}).outside[-1] == (
        "tree_density is 0 to 0.2 1/m^2; trained for 0 to 0.1 1/m^2"
    )
    undeclared = dataclasses.replace(found.policy.contract, courses=None)
    assert UNDECLARED in dataclasses.replace(found, policy=dataclasses.replace(found.policy, contract=undeclared)).notes


def test_a_contract_with_and_without_declaration() -> None:
    contract = load_policy("race_any").contract
    assert Contract.from_json(contract.to_json()).courses == RACING.domain
    content = json.loads(contract.to_json())
    older = Contract.from_json(json.dumps({key: value for key, value in content.items() if key != "courses"}))
    assert older == dataclasses.replace(contract, courses=None)
    assert "courses" not in json.loads(older.to_json())
    assert TaskConfig().domain() is None  # of a task of one's own that says nothing
    assert Contract.from_json(json.dumps(content | {"courses": []})).courses == ()


@pytest.mark.parametrize(
    ("courses", "message"),
    [
        (3, "courses is 3; accepted: a list of ranges"),
        ([{"name": "speed"}], r"missing key 'courses\[0\].unit', "),
        ([{"name": "a b", "unit": "m", "low": 0, "high": 1}], r"courses\[0\].name is 'a b'; accepted: a word"),
        ([{"name": "a", "unit": "m", "low": 2, "high": 1}], r"courses\[0\].low is 2.0; accepted: at most .*high, 1"),
        ([{"name": "a", "unit": "m", "low": 0, "high": math.nan}], r"courses\[0\].high is nan"),
        ([{"name": "a", "unit": "m", "low": 0, "high": 1}] * 2, r"courses\[1\].name is 'a'; accepted: .* each once"),
    ],
)  # fmt: skip
def test_a_broken_declaration_is_refused(courses: object, message: str) -> None:
    content = json.loads(load_policy("hover").contract.to_json()) | {"courses": courses}
    with pytest.raises(ValueError, match=message):
        Contract.from_json(json.dumps(content))


def test_a_domain_is_text_for_people() -> None:
    domain: Domain = (Extent("speed", "m/s", 3.0, 10.0), Extent("gates", "1", 4, 4))
    assert list(map(str, domain)) == ["speed 3 to 10 m/s", "gates 4"]
