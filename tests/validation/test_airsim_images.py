"""AirSim's own images: their wire beside the published client's, what a policy sees by them, and bad input."""

import dataclasses
import json
import math
from collections.abc import Callable, Iterator
from typing import Any

import cosysairsim
import jax
import numpy as np
import pytest

from e2efly.commands.cli import run
from e2efly.config import CameraConfig
from e2efly.policy.contract import Contract
from e2efly.policy.images import Image
from e2efly.policy.loader import load_policy
from e2efly.policy.zoo import policy_file
from e2efly.simulation.sensors.eyes import Eye
from e2efly.validation.airsim.airsim_camera import camera_of, opened, taken
from e2efly.validation.airsim.airsim_images import DEPTH_PERSPECTIVE, DEPTH_PLANAR, SCENE, SEGMENTATION, fields_of_view
from e2efly.validation.airsim.lockstep import AirSimSession
from e2efly.validation.airsim.rpc import Rpc, RpcError
from e2efly.validation.airsim.settings_file import settings, unsaid
from e2efly.validation.candidate import candidate
from e2efly.validation.evaluation import SEED
from e2efly.validation.fleet import FleetFlight, FleetMission, fly_all
from e2efly.validation.plant import RigidState, Shutter
from e2efly.validation.plant_sight import Sight
from e2efly.validation.plants import find_plant
from e2efly.validation.plants.airsim import AirsimPlant
from e2efly.validation.reality import Reality
from e2efly.validation.starts import draw_starts
from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.vehicle import Vehicle
from tests.validation.airsim_client import Tap, packed, published
from tests.validation.airsim_eyes import PAD, PALETTE
from tests.validation.airsim_server import Server, World

DRONE = "vis_r"
PERIOD = 1 / 30
SMALL = {"rtol": 0, "atol": 1e-5}


@pytest.fixture(scope="module")
def landing() -> Contract:
    return load_policy(policy_file("land_visual")).contract


@pytest.fixture(scope="module")
def pad() -> Sight:
    """What the first start of land_visual sees."""
    found = candidate("land_visual")
    env = found.environment(found.task.criteria()["land_visual"])
    (sight,) = draw_starts(env, 1, SEED).sights(env, SEED)
    assert sight is not None
    return sight


@pytest.fixture
def connect() -> Iterator[Callable[[Server], AirSimSession]]:
    """Makes sessions, and ends them."""
    made: list[AirSimSession] = []

    def connected(server: Server) -> AirSimSession:
        made.append(AirSimSession(Rpc("127.0.0.1", server.port), DRONE))
        return made[-1]

    yield connected
    for session in made:
        session.close()


def served(vehicle: Vehicle, images: tuple[Image, ...], sight: Sight, version: int = 4, kinds: Any = ()) -> Server:
    """A server whose settings are those that `airsim-settings` writes, in the world of a flight."""
    world = World(vehicle, version, settings(vehicle, images))
    world.eyes.show(sight.scene, *kinds)
    return Server(world)


def of(image: Image, **changes: Any) -> Image:
    """Another camera for the same policy."""
    none = {"of": "none"} if changes.get("sees", "mask") != "mask" else {}
    return dataclasses.replace(image, **none, **changes)


def hovering(session: AirSimSession, height: float = 2.0) -> RigidState:
    """Placed over the pad, level."""
    state = RigidState(np.array([0.1, -0.2, height]), np.zeros(3), np.eye(4)[0], np.zeros(3))
    session.begin(state)
    return state


@pytest.mark.whole
def test_requests_are_byte_for_byte_those_of_the_published_client(
    vis_r: Vehicle, landing: Contract, pad: Sight
) -> None:
    kinds = {SCENE: "Scene", DEPTH_PLANAR: "DepthPlanar", DEPTH_PERSPECTIVE: "DepthPerspective"}
    kinds[SEGMENTATION] = "Segmentation"
    with served(vis_r, landing.images, pad, kinds=kinds) as server:
        theirs, ours = Tap(server.port), Tap(server.port)
        session = AirSimSession(Rpc("127.0.0.1", ours.port), DRONE)
        with published(theirs.port) as client:
            for kind, name in kinds.items():
                floats = name.startswith("Depth")
                asked = cosysairsim.ImageRequest("image_0", getattr(cosysairsim.ImageType, name), floats, False)
                client.simGetImages([asked], DRONE)
                client.simGetCameraInfo("image_0", DRONE)
                session.picture("image_0", kind)
                session.field_of_view("image_0")
                wire, golden = ours.requests(), theirs.requests()
                for method in ("simGetImages", "simGetCameraInfo"):
                    assert wire[method] == golden[method], (method, name)
        session.close()


def test_requests_to_airsim_itself_have_its_own_parameters(vis_r: Vehicle, landing: Contract, pad: Sight) -> None:
    """No published client of AirSim 1.8.1 can be installed: by its source, one parameter more and one field less."""
    with served(vis_r, landing.images, pad, version=1) as server:
        tap = Tap(server.port)
        session = AirSimSession(Rpc("127.0.0.1", tap.port), DRONE)
        session.picture("image_0", SEGMENTATION)
        session.field_of_view("image_0")
        request = {"camera_name": "image_0", "image_type": 5, "pixels_as_float": False, "compress": False}
        wire = tap.requests()
        assert wire["simGetImages"] == packed("simGetImages") + packed([[request], DRONE, False])
        assert wire["simGetCameraInfo"] == packed("simGetCameraInfo") + packed(["image_0", DRONE, False])
        session.close()


def test_the_published_client_reads_the_same_pictures(
    vis_r: Vehicle, landing: Contract, pad: Sight, connect: Any
) -> None:
    """Of both dialects, whose bytes of colours stand the other way round."""
    seen = {}
    for version in (4, 1):
        with served(vis_r, landing.images, pad, version, (SCENE, DEPTH_PLANAR, DEPTH_PERSPECTIVE)) as server:
            session = connect(server)
            state = hovering(session)
            session.tick()  # the game draws the vehicle there
            for kind in (SCENE, DEPTH_PLANAR, DEPTH_PERSPECTIVE, SEGMENTATION):
                seen[version, kind] = session.picture("image_0", kind)
            if version == 1:
                continue
            with published(server.port) as client:
                for kind in (SCENE, DEPTH_PLANAR, DEPTH_PERSPECTIVE, SEGMENTATION):
                    floats, ours = kind in (DEPTH_PLANAR, DEPTH_PERSPECTIVE), seen[4, kind]
                    asked = cosysairsim.ImageRequest("image_0", kind, floats, False)
                    answers: Any = client.simGetImages([asked], DRONE)
                    (answer,) = answers
                    data = answer.image_data_float if floats else answer.image_data_uint8
                    theirs = np.array(data) if floats else np.frombuffer(data, np.uint8)
                    shape = (answer.height, answer.width, *([] if floats else [3]))
                    np.testing.assert_array_equal(theirs.reshape(shape), ours.image)
                    place = answer.camera_position.to_numpy_array()
                    np.testing.assert_allclose(place[[1, 0, 2]] * [1, 1, -1], ours.position, atol=1e-6)
                    np.testing.assert_allclose(ours.position, state.position, atol=1e-3)
                info: Any = client.simGetCameraInfo("image_0", DRONE)
                assert info.fov == pytest.approx(90.0)
    for kind in (SCENE, DEPTH_PLANAR, DEPTH_PERSPECTIVE, SEGMENTATION):
        np.testing.assert_array_equal(seen[1, kind].image, seen[4, kind].image)
    planar, distance = seen[4, DEPTH_PLANAR].image, seen[4, DEPTH_PERSPECTIVE].image
    assert planar.shape == (144, 256)  # what AirSim takes where the settings do not say
    assert np.median(planar) == pytest.approx(2.0, abs=2e-3)  # straight down on flat ground
    slope = math.sqrt(1 + (255 / 256) ** 2 + (143 / 256) ** 2)
    assert distance[0, 0] == pytest.approx(2.0 * slope, rel=1e-3)
    assert {tuple(colour) for colour in seen[4, SEGMENTATION].image.reshape(-1, 3)} <= set(map(tuple, PALETTE))


@pytest.mark.whole(but=1)
@pytest.mark.parametrize(
    ("changes", "camera"),
    [
        ({}, CameraConfig("mask")),
        ({"sees": "depth", "encoding": "inverse", "reach_m": (0.28, 10.0), "pitch_rad": 0.6}, CameraConfig("depth")),
        (
            {"sees": "range", "encoding": "log", "position_m": (0.1, 0.03, -0.02), "pitch_rad": 0.4},
            CameraConfig("range"),
        ),
        ({"sees": "rgb", "pitch_rad": 0.8, "width": 12, "height": 16, "pool": (16, 12)}, CameraConfig("rgb")),
    ],
)
def test_a_policy_sees_by_airsim_what_it_sees_by_us_a_latency_ago(
    changes: dict[str, Any], camera: CameraConfig, vis_r: Vehicle, landing: Contract, pad: Sight
) -> None:
    """In flight, every other control step, 40 ms late, though the game draws the vehicle every 15 ms only.

    What is shown is like the exposure that we would show, and unlike those before and after it.
    """
    image = of(landing.images[0], **changes)
    if image.width == 12:  # square pixels, higher than wide
        image = dataclasses.replace(image, fov_rad=fields_of_view(90.0, 12, 16))
    camera = dataclasses.replace(
        camera, width=image.width, height=image.height, fov=image.fov_rad, reach=image.reach_m, pitch=image.pitch_rad,
        position=image.position_m, rate=15.0,
    )  # fmt: skip
    eye = Eye.of(camera, jax.random.key(0), 1)
    eye = dataclasses.replace(eye, latency=np.array([0.04], np.float32))
    sight = dataclasses.replace(pad, cameras=(camera,), eyes=(eye,), oldest=0.04, period=PERIOD)
    contract = dataclasses.replace(landing, images=(image,))
    with served(vis_r, contract.images, pad) as server:
        where = "image_0" + (f":{PAD}" if image.sees == "mask" else "")
        kind = find_plant(f"airsim:127.0.0.1:{server.port}").seeing({"image_0": where})
        plant = kind.of(vis_r, contract)
        assert isinstance(plant, AirsimPlant)
        plant.expose({"image_0": sight.shutter(0)})
        start = RigidState(np.array([-0.3, 0.1, 2.2]), np.array([1.5, 0.3, -2.0]), np.eye(4)[0], np.array([0, 0.4, 0]))
        plant.reset(start)
        watch, states, theirs, ours = sight.begin(), [], [], []
        for k in range(12):
            s = plant.state
            states.append(dataclasses.replace(s, position=s.position + plant._origin))  # where the server has it
            theirs.append(plant.shown("image_0", k * PERIOD))
            ours.append(watch.images(k, states)[0])
            plant.step(np.array([GRAVITY, 0.0, 0.4, 0.0]), PERIOD)
        plant.close()
    theirs, ours = np.array(theirs), np.array(ours)
    assert np.linalg.norm(states[-1].position - states[0].position) > 0.8
    middle = np.median if image.sees in ("depth", "range") else np.mean
    off = middle(np.abs(theirs - ours)[4:-2])
    before, after = (middle(np.abs(theirs[4:-2] - ours[4 + shift : 10 + shift])) for shift in (-2, 2))
    assert middle(np.abs(theirs - ours)) < 0.02
    assert off < 0.5 * min(before, after)
    assert image.sees != "mask" or 0 < theirs[-1].sum() < theirs[-1].size


def test_exposures_are_those_of_the_contract() -> None:
    shutter = Shutter(every=0.1, latency=0.04)
    assert [shutter.exposed(n) for n in range(3)] == pytest.approx([0.0, 0.06, 0.16])
    assert [shutter.newest(now) for now in (0.0, 0.09, 3 * (0.1 / 3), 0.2)] == [0, 0, 1, 2]


@pytest.mark.whole
def test_a_policy_lands_by_airsims_own_images(
    vis_r: Vehicle, landing: Contract, pad: Sight, capsys: pytest.CaptureFixture[str], tmp_path: Any
) -> None:
    with served(vis_r, landing.images, pad, version=1) as server:
        arguments = ["validate", "land_visual", "--plant", f"airsim:127.0.0.1:{server.port}", "--episodes", "1"]
        report = tmp_path / "report.json"
        more = ["--image", f"image_0=plant:image_0:{PAD}", "--json", str(report), "--out", str(tmp_path)]
        assert run([*arguments, *more]) == 0
        asked = [method for method, _ in server.calls].count("simGetImages")
        assert "AirSim's camera 'image_0' shows" in " ".join(capsys.readouterr().out.split())
        content = json.loads(report.read_text())
        assert content["criteria"]["land_visual"]["airsim"]["success"] == 1.0
        assert asked > 30

        found = candidate("land_visual")
        suite = found.task.criteria()["land_visual"]
        env = found.environment(suite)
        starts = draw_starts(env, 1, SEED)
        plant, own = f"airsim:127.0.0.1:{server.port}", {"image_0": "image_0:1,2,3"}  # the colour of nothing
        mission = FleetMission(found.file, plant, vis_r, vis_r, float(suite.episode_s), own)
        flight = FleetFlight(starts.states[0], starts.courses[0], Reality(vis_r, found.latency), pad)
        (blind,) = fly_all(mission, [flight])
        assert not blind.success


REFUSED: list[tuple[dict[str, Any], str]] = [
    ({"width": 7}, r"ImageResponse.image_data_uint8 is 768 bytes; accepted: 336 bytes: 16 rows of 7 pixels of 3"),
    ({"width": 0}, r"ImageResponse.width is 0; accepted: 1 to 4096 pixels"),
    ({"height": None}, r"ImageResponse.height is None; accepted: 1 to 4096 pixels"),
    ({"image_data_uint8": b""}, r"ImageResponse.image_data_uint8 is 0 bytes; accepted: 768 bytes"),
    ({"width": 0, "height": 0, "message": "not set"}, r"ImageResponse.message is not set; accepted"),
    ({"image_type": 0}, r"ImageResponse.image_type is 0; accepted: 5"),
    ({"camera_position": {"x_val": 1.0}}, r"ImageResponse.camera_position.y_val is None; accepted: a finite number"),
    (
        {"camera_orientation": {"w_val": 2.0, "x_val": 0.0, "y_val": 0.0, "z_val": 0.0}},
        r"ImageResponse.camera_orientation is \[2.0, .*accepted: a unit quaternion",
    ),
    (
        {"camera_position": {"x_val": 9.0, "y_val": 0.0, "z_val": 0.0}},
        r"a picture is taken \[.*\] m \(forward, left, up\) from the vehicle.*accepted: \[0.0, 0.0, 0.0\] m to",
    ),
    (
        {"camera_orientation": {"w_val": 1.0, "x_val": 0.0, "y_val": 0.0, "z_val": 0.0}},
        r"120.00 degrees from where the camera is to look; accepted: .* 90 degrees downwards to within 1.00",
    ),
]


@pytest.mark.parametrize(("changes", "told"), REFUSED)
def test_an_answer_that_is_no_picture_of_this_camera_is_named(
    changes: dict[str, Any], told: str, vis_r: Vehicle, landing: Contract, pad: Sight, connect: Any
) -> None:
    with served(vis_r, landing.images, pad) as server:
        session = connect(server)
        hovering(session)
        server.world.eyes.changes = changes
        with pytest.raises(ValueError, match=f"airsim:127.0.0.1:{server.port}: .*camera 'image_0'.*{told}"):
            opened(session, camera_of(f"image_0:{PAD}", landing.images[0]))


@pytest.mark.parametrize(
    ("value", "told"),
    [
        (math.nan, r"image_data_float in row 1, column 4 is nan; accepted: 0 or more metres"),
        (-1.0, r"image_data_float in row 1, column 4 is -1.0; accepted: 0 or more metres"),
        ("far", r"image_data_float is .*; accepted: numbers"),
    ],
)
def test_depth_that_is_none_is_named(
    value: Any, told: str, vis_r: Vehicle, landing: Contract, pad: Sight, connect: Any
) -> None:
    image = of(landing.images[0], sees="depth", encoding="inverse")
    with served(vis_r, (image,), pad) as server:
        session = connect(server)
        hovering(session)
        camera = opened(session, camera_of("image_0", image))
        data: list[Any] = [1.0] * 256
        data[20] = value
        server.world.eyes.changes = {"image_data_float": data}
        with pytest.raises(ValueError, match=told):
            taken(session, camera)
        server.world.eyes.changes = {"image_data_float": [1.0] * 255 + [math.inf]}  # the sky
        assert taken(session, camera)[-1, -1] == image.reach_m[1]
        server.world.eyes.changes = {"width": 8, "height": 32, "image_data_float": [1.0] * 256}
        with pytest.raises(ValueError, match="has 8 columns and 32 rows; accepted: 16 and 16, as the first"):
            taken(session, camera)


def test_a_camera_that_is_not_the_contracts_is_named(
    vis_r: Vehicle, landing: Contract, pad: Sight, connect: Any
) -> None:
    (image,) = landing.images
    with served(vis_r, landing.images, pad) as server:
        session = connect(server)
        hovering(session)
        with pytest.raises(
            RpcError, match=r"simGetImages failed: .*map::at.*asked for camera 'chin'; accepted: a camera"
        ):
            opened(session, camera_of(f"chin:{PAD}", image))
        assert "simGetCameraInfo" not in {method for method, _ in server.calls}  # it would end AirSim
        wide = dataclasses.replace(image, fov_rad=(1.8, 1.8))
        with pytest.raises(ValueError, match=r"for image_0 sees 1.571 rad across; accepted: 1.800 rad or more"):
            opened(session, camera_of(f"image_0:{PAD}", wide))
        fine = dataclasses.replace(image, width=32, height=32, pool=(32, 32))
        with pytest.raises(ValueError, match=r"has 16 rows and 16 columns; accepted: so many"):
            opened(session, camera_of(f"image_0:{PAD}", fine))
        (own,) = server.world.settings["Vehicles"].values()
        own["Cameras"]["image_0"]["CaptureSettings"][0]["FOV_Degrees"] = 80.0
        with pytest.raises(
            ValueError, match=r"simGetCameraInfo says a field of view of 80 degrees, and .* is 90; accept"
        ):
            opened(AirSimSession(session.rpc, DRONE), camera_of(f"image_0:{PAD}", image))


@pytest.mark.parametrize(
    ("where", "changes", "told"),
    [
        ("down", {}, r"which colour of AirSim's segmentation is 'pad' no AirSim says; accepted: plant:CAMERA"),
        ("down:1,2", {}, r"'plant:down:1,2'; accepted: plant:CAMERA.*each 0 to 255"),
        ("down:1,2,256", {}, r"accepted: plant:CAMERA.*each 0 to 255"),
        ("down:1,2,x", {}, r"accepted: plant:CAMERA.*each 0 to 255"),
        ("", {"sees": "rgb"}, r"--image image_0 is 'plant:'; accepted: plant:CAMERA"),
        ("down:1,2,3", {"sees": "rgb"}, r"'plant:down:1,2,3'; accepted: plant:CAMERA"),
        ("down", {"sees": "normal"}, r"the policy sees normal; accepted of AirSim: depth, range, rgb, mask"),
        ("down", {"sees": "range", "projection": "spherical"}, r"is spherical; accepted of AirSim: pinhole"),
    ],
)
def test_what_airsim_cannot_show_is_named_before_it_is_asked(
    where: str, changes: dict[str, Any], told: str, landing: Contract
) -> None:
    with pytest.raises(ValueError, match=told):
        camera_of(where, of(landing.images[0], **changes))


@pytest.mark.parametrize(
    ("more", "told"),
    [
        (["--image", "image_0=plant:down"], "accepted on plant 'simulator', which has no cameras of its own"),
        (["--image", "image_0=shm:front"], "--image image_0 is 'shm:front'; accepted: image_0=plant:CAMERA"),
        (["--image", "image_7=plant:down"], "--image is 'image_7=plant:down'; accepted: NAME=URI, NAME one of image_0"),
        (["--stress", "--image", "image_0=plant:down"], "--image is 'image_0=plant:down'; accepted without --stress"),
    ],
)
def test_options_that_cannot_be_are_named(more: list[str], told: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["validate", "land_visual", "--plant", "simulator", "--episodes", "1", *more]) == 2
    assert told in " ".join(capsys.readouterr().err.split())


@pytest.mark.parametrize("policy", ["avoid", "race_clutter", "land_visual"])
def test_a_camera_of_the_settings_sees_what_the_policy_does(policy: str, vis_r: Vehicle) -> None:
    (image,) = load_policy(policy_file(policy)).contract.images
    (own,) = settings(vis_r, (image,))["Vehicles"].values()
    camera = own["Cameras"]["image_0"]
    both = {tuple(row[key] for key in ("Width", "Height", "FOV_Degrees")) for row in camera["CaptureSettings"]}
    ((width, height, longer),) = both
    assert {row["ImageType"] for row in camera["CaptureSettings"]} == {-1, 5 if policy == "land_visual" else 1}
    across, down = fields_of_view(longer, width, height)
    assert across == pytest.approx(image.fov_rad[0], rel=1e-6)
    assert image.fov_rad[1] - 1e-6 <= down < image.fov_rad[1] * 1.02
    assert (
        (width, height) == (16, 16) if policy == "land_visual" else min(width / image.width, height / image.height) >= 4
    )


def test_settings_of_a_camera_that_is_higher_than_wide(vis_r: Vehicle, landing: Contract) -> None:
    tall = dataclasses.replace(landing.images[0], width=12, height=16, fov_rad=fields_of_view(100.0, 12, 16))
    (own,) = settings(vis_r, (tall,))["Vehicles"].values()
    capture = own["Cameras"]["image_0"]["CaptureSettings"][-1]
    assert (capture["Width"], capture["Height"]) == (12, 16)
    assert capture["FOV_Degrees"] == pytest.approx(100.0)  # of its longer side
    normal = of(tall, sees="normal")
    assert "Cameras" not in next(iter(settings(vis_r, (normal,))["Vehicles"].values()))
    assert ("image 'image_0'", "sees normal", "no camera") in unsaid(vis_r, (normal,))
