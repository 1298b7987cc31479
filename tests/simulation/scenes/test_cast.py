"""The caster: images that can be computed by hand, and what must not change them."""

import dataclasses
import math
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from e2efly.config import CameraConfig
from e2efly.control.vectors import rotate
from e2efly.courses.solids import SIZES
from e2efly.environment import random_key
from e2efly.simulation.physics.rotation import from_euler, multiply
from e2efly.simulation.scenes import camera, cast
from e2efly.simulation.scenes.scene import GATE, GROUND, OBSTACLE, SKY, Scene, Solids
from e2efly.simulation.scenes.shapes import FAR

LEVEL = np.array([[1.0, 0.0, 0.0, 0.0]], np.float32)
WIDE = CameraConfig(width=48, height=32, fov=(1.6, 1.2))


def see(
    scene: Scene,
    config: CameraConfig = WIDE,
    position: Any = (0.0, 0.0, 2.0),
    quaternion: Any = LEVEL,
    tile: tuple[int, int] | None = None,
    channels: tuple[str, ...] = cast.CHANNELS,
) -> dict[str, np.ndarray]:
    n = scene.worlds
    pattern = camera.pattern(config)
    if tile:
        pattern = cast.Pattern.of(pattern.directions, True, tile)
    at = np.broadcast_to(np.asarray(position, np.float32), (n, 3))
    turned = np.broadcast_to(np.asarray(quaternion, np.float32), (n, 4))
    origin, matrix = camera.pose(camera.mount(config, n), jnp.asarray(at), jnp.asarray(turned))
    images = cast.cast(scene, origin, matrix, pattern, channels, cast.usual_light(n))
    return jax.tree.map(np.asarray, images)


def crowd(n: int = 6, seed: int = 0) -> Scene:
    """Two solids of each kind in every world, before a camera at (0, 0, 2) that looks along x."""
    rng = np.random.default_rng(seed)
    solids = {}
    for kind, names in SIZES.items():
        place = np.stack([rng.uniform(2, 7, (n, 2)), rng.uniform(-3, 3, (n, 2)), rng.uniform(0.5, 3.5, (n, 2))], -1)
        size = rng.uniform(0.15, 0.6, (n, 2, len(names)))
        if kind == "pad":
            size[..., 2] = rng.integers(0, 3, (n, 2))
        one = Solids.of(kind, place, size)
        turn = from_euler(*(jnp.asarray(rng.uniform(-3, 3, (n, 2)), jnp.float32) for _ in range(3)))
        solids[kind] = dataclasses.replace(one, quaternion=turn)
    return Scene.of(solids, n)


def one(kind: str, centre: Any, size: Any, ground: float | None = None, **about: Any) -> Scene:
    solids = Solids.of(kind, np.asarray(centre)[None, None], np.asarray(size)[None, None], **about)
    return Scene.of({kind: solids}, 1, ground)


@pytest.mark.whole
def test_a_wall_ahead_is_at_the_same_depth_everywhere() -> None:
    images = see(one("box", (5.0, 0.0, 2.0), (0.5, 50.0, 50.0)))
    np.testing.assert_allclose(images["depth"][0], 4.5, rtol=1e-5)
    np.testing.assert_allclose(images["normal"][0], np.broadcast_to([-1.0, 0.0, 0.0], (32, 48, 3)), atol=1e-6)
    assert np.all(images["label"] == OBSTACLE) and np.all(images["instance"] == 2)


def test_the_ground_lies_at_height_over_the_slope_of_the_ray() -> None:
    images = see(Scene.of({}, 1), CameraConfig(width=8, height=8, fov=(1.2, 1.2)))
    rows = ((np.arange(8) + 0.5) / 4 - 1) * math.tan(0.6)
    expected = np.where(rows > 0, 2.0 / np.where(rows > 0, rows, 1.0), FAR)
    np.testing.assert_allclose(images["depth"][0], np.broadcast_to(expected[:, None], (8, 8)), rtol=1e-5)
    np.testing.assert_array_equal(images["label"][0, :, 0], np.where(rows > 0, GROUND, SKY))
    assert np.all(images["normal"][0, 4:] == [0.0, 0.0, 1.0]) and np.all(images["normal"][0, :4] == 0)
    none = see(Scene.of({}, 1, ground=None))
    assert np.all(none["depth"] == FAR) and np.all(none["label"] == SKY) and np.all(none["instance"] == 0)


def test_the_silhouette_of_a_ball_is_the_cone_that_touches_it() -> None:
    images = see(one("sphere", (4.0, 0.0, 2.0), (1.0,)), CameraConfig(width=200, height=200, fov=(1.2, 1.2)))
    place = ((np.arange(200) + 0.5) / 100 - 1) * math.tan(0.6)
    off_axis = np.hypot(place[:, None], place[None])
    inside = off_axis < math.tan(math.asin(1 / 4.0))
    edge = np.abs(off_axis - math.tan(math.asin(1 / 4.0))) < 1e-3
    np.testing.assert_array_equal((images["label"][0] == OBSTACLE)[~edge], inside[~edge])
    assert images["depth"][0].min() == pytest.approx(3.0, abs=1e-3)


def test_through_the_opening_of_a_gate_one_sees_what_is_behind() -> None:
    size = (0.5, 0.4, 0.1, 0.05)
    images = see(one("gate", (3.0, 0.0, 2.0), size), CameraConfig(width=240, height=240, fov=(0.8, 0.8)))
    y, z = (((np.arange(240) + 0.5) / 120 - 1) * math.tan(0.4) for _ in range(2))
    # the front's opening hides what its far edge leaves free
    free = (np.abs(y) < 0.5 / 3.05)[None] & (np.abs(z) < 0.4 / 3.05)[:, None]
    frame = (np.abs(y) < 0.6 / 2.95)[None] & (np.abs(z) < 0.5 / 2.95)[:, None] & ~free
    np.testing.assert_array_equal(images["label"][0] == GATE, frame)


@pytest.mark.whole
def test_what_is_not_there_is_not_seen() -> None:
    scene = crowd()
    gone = {kind: dataclasses.replace(s, active=jnp.zeros_like(s.active)) for kind, s in scene.solids.items()}
    images, empty = see(Scene(scene.ground, gone)), see(Scene.of({}, scene.worlds))
    for name in cast.CHANNELS:
        np.testing.assert_array_equal(images[name], empty[name], err_msg=name)


@pytest.mark.whole(but=1)
@pytest.mark.parametrize("tile", [(1, 1), (32, 48), (4, 16)])
def test_tiles_and_what_is_left_out_of_them_change_nothing(tile: tuple[int, int]) -> None:
    scene = crowd()
    images, others = see(scene), see(scene, tile=tile)
    for name in cast.CHANNELS:
        np.testing.assert_allclose(images[name], others[name], rtol=0, atol=1e-4, err_msg=name)


@pytest.mark.whole
def test_an_accelerators_way_gives_the_same_images(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = crowd()
    images = see(scene)
    monkeypatch.setattr(jax, "default_backend", lambda: "gpu")
    others = see(scene)
    for name in cast.CHANNELS:
        same = np.isclose(images[name], others[name], atol=1e-4)
        assert np.mean(same) > 0.9995, name


@pytest.mark.whole
def test_turning_and_moving_the_world_with_the_camera_changes_nothing() -> None:
    scene = Scene(crowd().ground - FAR, crowd().solids)  # the ground stays level
    turn = from_euler(jnp.float32(0.4), jnp.float32(-0.7), jnp.float32(2.0))
    shift = jnp.array([3.0, -2.0, 1.0])

    def move(s: Solids) -> Solids:
        turned = multiply(jnp.broadcast_to(turn, s.quaternion.shape), s.quaternion)
        return dataclasses.replace(s, centre=rotate(turn, s.centre) + shift, quaternion=turned)

    moved = {kind: move(s) for kind, s in scene.solids.items()}
    images = see(scene, channels=("depth", "instance"))
    others = see(
        Scene(scene.ground, moved), position=rotate(turn, jnp.array([0.0, 0.0, 2.0])) + shift, quaternion=turn,
        channels=("depth", "instance"),
    )  # fmt: skip
    same = (images["instance"] == others["instance"]) & np.isclose(images["depth"], others["depth"], rtol=1e-3)
    assert np.mean(same) > 0.998  # silhouettes


def test_inside_a_solid_everything_is_at_hand() -> None:
    for kind, size in (("box", (1.0, 1.0, 1.0)), ("sphere", (1.0,)), ("cylinder", (1.0, 1.0)), ("capsule", (1.0, 1.0))):
        images = see(one(kind, (0.0, 0.0, 2.0), size))
        assert np.all(images["depth"] == 0.0) and np.all(np.isfinite(images["rgb"])), kind


@pytest.mark.whole
def test_instances_are_counted_kind_after_kind() -> None:
    scene = crowd()
    images = see(scene)
    labels = {int(i): set(images["label"][images["instance"] == i]) for i in np.unique(images["instance"])}
    solids = sum(s.count for s in scene.solids.values())
    assert all(len(found) == 1 for found in labels.values()) and set(labels) <= set(range(2 + solids))


def test_shadows_fall_away_from_the_sun_and_colours_stay_in_range() -> None:
    scene = one("box", (4.0, 0.0, 1.0), (0.5, 0.5, 0.5), 0.0)
    down = CameraConfig(width=64, height=64, fov=(1.5, 1.5), pitch=math.pi / 2)
    light = cast.Light(np.array([[-0.6, 0.0, 0.8]], np.float32), np.array([0.7], np.float32), np.zeros(1, np.float32))
    origin, matrix = camera.pose(camera.mount(down, 1), jnp.array([[4.0, 0.0, 6.0]]), jnp.asarray(LEVEL))
    rgb = np.asarray(cast.cast(scene, origin, matrix, camera.pattern(down), ("rgb",), light)["rgb"][0])
    assert rgb.min() >= 0 and rgb.max() <= 1

    def ground(x: float, y: float) -> np.ndarray:
        row, column = (round(32 - 32 * v / 6 / math.tan(0.75)) for v in (x - 4.0, y))
        return rgb[row, column]

    assert ground(5.0, 0.0)[0] < 0.5 * ground(2.5, 0.0)[0]  # its shadow reaches from x 3.9 to 5.6
    np.testing.assert_allclose(ground(6.2, 0.0), ground(2.5, 0.0), rtol=1e-4)


def test_rgb_knows_the_colours() -> None:
    rgb = see(one("sphere", (4.0, 0.0, 2.0), (1.0,), colour=(0.9, 0.1, 0.2)))["rgb"][0]
    middle = rgb[16, 24]
    np.testing.assert_allclose(middle / middle[0], [1.0, 0.1 / 0.9, 0.2 / 0.9], rtol=1e-3)


def test_a_lidar_measures_distances_all_around() -> None:
    lidar = dataclasses.replace(camera.PRESETS["lidar"], width=72, height=8)
    images = see(one("cylinder", (0.0, 0.0, 2.0), (3.0, 5.0)), lidar, position=(5.0, 0.0, 2.0), channels=("depth",))
    elevation = -((np.arange(8) + 0.5) / 4 - 1) * lidar.fov[1] / 2
    back = images["depth"][0][:, 0]  # azimuth -180 degrees, the cylinder's side 2 m behind
    azimuth = lidar.fov[0] / 2 / 72
    across = 5 * math.cos(azimuth) - math.sqrt(9 - (5 * math.sin(azimuth)) ** 2)
    np.testing.assert_allclose(back, across / np.cos(elevation), rtol=1e-4)


def at_two_metres(config: CameraConfig, scene: Scene) -> np.ndarray:
    return np.asarray(
        camera.look(config, scene, camera.mount(config, 1), jnp.array([[0.0, 0.0, 2.0]]), jnp.asarray(LEVEL))
    )


def test_depth_is_planar_range_is_along_the_ray_and_both_have_a_reach() -> None:
    wall = one("box", (5.0, 0.0, 2.0), (0.5, 50.0, 50.0))
    rows, columns = (((np.arange(k) + 0.5) / k * 2 - 1) * math.tan(a) for k, a in ((32, 0.6), (48, 0.8)))
    length = np.sqrt(1 + rows[:, None] ** 2 + columns[None] ** 2)
    np.testing.assert_allclose(at_two_metres(WIDE, wall)[0], 4.5, rtol=1e-5)
    ranges = at_two_metres(dataclasses.replace(WIDE, sees="range"), wall)[0]
    np.testing.assert_allclose(ranges, 4.5 * length, rtol=1e-5)
    assert np.all(at_two_metres(dataclasses.replace(WIDE, reach=(0.0, 3.0)), wall) == 3.0)
    assert np.all(at_two_metres(dataclasses.replace(WIDE, reach=(5.0, 9.0)), wall) == 0.0)


@pytest.mark.whole
def test_every_preset_sees() -> None:
    scene = one("gate", (0.8, 0.0, 1.6), (0.3, 0.3, 0.1, 0.05), 0.0)
    seen = {name: at_two_metres(config, scene) for name, config in camera.PRESETS.items()}
    assert seen["d435i"].shape == (1, 64, 64) and 0.28 <= seen["d435i"].min() < 1.0 and seen["d435i"].max() == 10.0
    assert seen["fpv"].shape == (1, 64, 64, 3) and seen["fpv"].std() > 0.05
    assert set(np.unique(seen["down"])) == {0.0}, "there is no pad"
    gates = dataclasses.replace(camera.PRESETS["down"], of="gate")
    assert set(np.unique(at_two_metres(gates, scene))) == {0.0, 1.0}
    assert seen["lidar"].shape == (1, 16, 360) and seen["lidar"].max() == 50.0


def test_cameras_sit_a_little_differently_where_asked() -> None:
    config = dataclasses.replace(
        WIDE, fov_spread=0.1, angle_spread=0.05, position_spread=0.02, position=(0.1, 0.0, 0.0)
    )
    same, key = camera.mount(config, 500), random_key(0)
    mounts = camera.mount(config, 500, key)
    np.testing.assert_allclose(np.abs(mounts.offset - same.offset).max(axis=0), 0.02, rtol=0.05)
    ahead = np.asarray(mounts.matrix[:, :, 2])
    assert 0.03 < np.arccos(np.clip(ahead[:, 0], -1, 1)).max() < 0.05 * math.sqrt(2) + 1e-3
    across = 2 * np.arctan(np.linalg.norm(mounts.matrix[:, :, 0], axis=1))
    assert across.min() == pytest.approx(1.6 * 0.9, rel=0.01) and across.max() == pytest.approx(1.6 * 1.1, rel=0.01)
    jax.tree.map(np.testing.assert_array_equal, mounts, camera.mount(config, 500, key))


@pytest.mark.parametrize(
    ("field", "value"),
    [("width", 0), ("fov", (3.2, 1.0)), ("fov", (1.0, 0.0)), ("reach", (2.0, 1.0)), ("reach", (-1.0, 1.0))],
)
def test_a_camera_that_cannot_be_is_refused(field: str, value: Any) -> None:
    with pytest.raises(ValueError, match=rf"camera\.{field}.*accepted"):
        camera.check(dataclasses.replace(WIDE, **{field: value}))


def test_a_channel_that_is_none_is_refused() -> None:
    with pytest.raises(ValueError, match=r"channels has \['colour'\]; accepted: depth"):
        see(crowd(), channels=("colour",))
