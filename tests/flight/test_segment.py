"""Masks of colours: tags, colours, a network. The truth is a drawn polygon."""

from pathlib import Path

import cv2
import numpy as np
import pytest
from onnx import NodeProto, TensorProto, helper

from e2efly.flight.sight.segment import chosen
from e2efly.flight.sight.segment.apriltag import FAMILIES, enlarged
from e2efly.flight.sight.segment.network import MaskNetwork

WIDE, HIGH = 640, 480
CORNERS = np.array([[250.0, 120.0], [410.0, 150.0], [395.0, 330.0], [230.0, 290.0]], np.float32)
"""Of a tag in the image, in turn from its upper left."""


def overlap(found: np.ndarray, true: np.ndarray) -> float:
    """Intersection over union."""
    return float((found & true).sum() / (found | true).sum())


def polygon(corners: np.ndarray) -> np.ndarray:
    """Mask of the pixels whose centres lie in a convex polygon, by the signs of cross products."""
    x, y = np.meshgrid(np.arange(WIDE) + 0.5, np.arange(HIGH) + 0.5)
    inside = np.ones((HIGH, WIDE), bool)
    for (ax, ay), (bx, by) in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        inside &= (bx - ax) * (y - ay) - (by - ay) * (x - ax) >= 0
    return inside.astype(np.uint8)


def tag(number: int, corners: np.ndarray = CORNERS, family: str = "36h11") -> np.ndarray:
    """A picture of a tag whose outer square has these corners, on grey ground with a white rim."""
    dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, f"DICT_APRILTAG_{family}"))
    side, rim = 400, 60
    drawn = cv2.copyMakeBorder(
        cv2.aruco.generateImageMarker(dictionary, number, side), rim, rim, rim, rim, cv2.BORDER_CONSTANT, value=255
    )
    square = np.array([[0, 0], [side, 0], [side, side], [0, side]], np.float32) + rim
    # a pixel's centre has whole coordinates to OpenCV, half ones here
    warp = cv2.getPerspectiveTransform(square - 0.5, corners - 0.5)
    ground = np.full((HIGH, WIDE), 110, np.uint8)
    picture = cv2.warpPerspective(drawn, warp, (WIDE, HIGH), dst=ground, borderMode=cv2.BORDER_TRANSPARENT)
    noise = np.random.default_rng(0).normal(0, 4, picture.shape)
    return np.repeat(np.clip(picture + noise, 0, 255).astype(np.uint8)[..., None], 3, axis=-1)


@pytest.mark.parametrize("family", FAMILIES)
def test_a_tags_mask_is_its_outer_square(family: str) -> None:
    found = chosen(f"apriltag:{family}:7")(tag(7, family=family))
    assert overlap(found, polygon(CORNERS)) > 0.97


def test_a_pad_wider_than_its_tag_is_wider_in_the_tags_plane() -> None:
    # the tag's square shrunk to a half about its centre in perspective: by the warp of the unit square
    unit = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]], np.float32)
    warp = cv2.getPerspectiveTransform(unit, CORNERS)
    inner = cv2.perspectiveTransform(unit[:, None] / 2.5, warp)[:, 0]
    found = chosen("apriltag:36h11:3x2.5")(tag(3, inner))
    assert overlap(found, polygon(CORNERS)) > 0.95
    assert overlap(chosen("apriltag:36h11:3")(tag(3, inner)), polygon(inner)) > 0.95


def test_a_pad_with_a_corner_behind_the_camera_is_its_tag() -> None:
    square = np.array([[0.0, 0.0], [100.0, 0.0], [150.0, 200.0], [-50.0, 200.0]])  # its horizon is at y = -200
    assert np.all(enlarged(square, 20.0) == square)
    assert enlarged(square, 1.2)[3, 1] > 200


def test_other_tags_are_no_pad_and_no_tag_is_no_mask() -> None:
    picture = tag(7)
    assert not chosen("apriltag:36h11:8,9")(picture).any()
    assert not chosen("apriltag:25h9")(picture).any()
    assert chosen("apriltag:36h11")(picture).any()  # any tag of the family
    assert not chosen("apriltag:36h11")(np.full_like(picture, 110)).any()


def test_a_small_tag_in_the_middle_takes_over_when_the_large_one_leaves_the_picture() -> None:
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    large = cv2.aruco.generateImageMarker(dictionary, 0, 800)
    small = cv2.copyMakeBorder(
        cv2.aruco.generateImageMarker(dictionary, 1, 120), 15, 15, 15, 15, cv2.BORDER_CONSTANT, value=255
    )
    large[325:475, 325:475] = small
    segmenter = chosen(f"apriltag:36h11:0,1x{800 / 120:.3f}")
    far = np.full((HIGH, WIDE), 230, np.uint8)
    far[200:280, 300:380] = cv2.resize(large, (80, 80), interpolation=cv2.INTER_AREA)
    truth = np.zeros_like(far)
    truth[200:280, 300:380] = 1
    assert overlap(segmenter(np.repeat(far[..., None], 3, axis=-1)), truth) > 0.8  # by the small one: 12 pixels wide
    near = cv2.resize(large[280:520, 240:560], (WIDE, HIGH))
    assert segmenter(np.repeat(near[..., None], 3, axis=-1)).all()


def test_a_colours_mask_is_the_largest_patch_with_its_holes_filled() -> None:
    picture = np.full((60, 80, 3), (90, 90, 90), np.uint8)
    picture[10:40, 20:60] = (20, 40, 200)
    picture[20:30, 30:40] = 255  # a marking
    picture[50:55, 5:10] = (20, 40, 200)  # something small of the same colour
    found = chosen("colour:210,50,30,250,100,100")(picture)
    truth = np.zeros((60, 80), np.uint8)
    truth[10:40, 20:60] = 1
    assert np.array_equal(found, truth)


def test_hues_go_on_through_360_degrees() -> None:
    hues = np.arange(0, 360, 4)
    wheel = np.array([[_rgb(h) for h in hues]], np.uint8)
    segmenter = chosen("colour:340,50,50,20,100,100")
    found = segmenter.within(wheel)[0].astype(bool)  # pyright: ignore
    sure = (hues > 342) | (hues < 18)
    assert found[sure].all()
    assert not found[(hues < 338) & (hues > 22)].any()


def _rgb(hue: float) -> list[float]:
    """Of full saturation and value."""
    return [255 * min(max(abs((hue / 60 + shift) % 6 - 3) - 1, 0), 1) for shift in (0, 4, 2)]


def test_bounds_of_saturation_and_value_are_percent() -> None:
    greys = np.arange(256, dtype=np.uint8)[None, :, None].repeat(3, axis=-1)
    found = chosen("colour:0,0,40,360,5,60").within(greys)[0]  # pyright: ignore
    assert np.array_equal(np.flatnonzero(found), np.arange(102, 154))


def model(shape: list[int | str], out: list[int | str], axes: list[int], *more: NodeProto) -> bytes:
    nodes = [*more, helper.make_node("ReduceMean", ["x"], ["y"], axes=axes, keepdims=0)]
    given, gives = (helper.make_tensor_value_info(n, TensorProto.FLOAT, s) for n, s in (("x", shape), ("y", out)))
    graph = helper.make_graph(nodes, "g", [given], [gives])
    return helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8).SerializeToString()


def test_a_network_of_the_users_own(tmp_path: Path) -> None:
    path = tmp_path / "mean.onnx"
    path.write_bytes(model([1, 48, 64, 3], [1, 48, 64], [3]))  # bright is pad
    picture = np.zeros((HIGH, WIDE, 3), np.uint8)
    picture[100:300, 200:400] = 200
    assert overlap(chosen(f"onnx:{path}")(picture), (picture[..., 0] > 0).astype(np.uint8)) > 0.95


MEAN: tuple[list[int | str], list[int | str], list[int]] = (["n", "h", "w", 3], ["n", "h", "w"], [3])


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"no network", "not an ONNX file: "),
        (model(["n", 3, "h", "w"], ["n", "h", "w"], [1]), "its input has the shape"),
        (model(["n", "h", "w", 3], ["n", 3], [1, 2]), "its output has the shape"),
        (None, "No such file"),
        (model([1, 10**6, 10**6, 3], [1, 10**6, 10**6], [3]), "its input has the shape"),
        (
            model(*MEAN, helper.make_node("RandomNormalLike", ["x"], ["z"])),
            "'RandomNormalLike' is none of Abs",
        ),
        (model(*MEAN, helper.make_node("Tile", ["x", "x"], ["z"])), "its operator 'Tile' is none of Abs, Add"),
        (model(*MEAN, helper.make_node("Shape", ["x"], ["z"]), helper.make_node("Pad", ["x", "z"], ["w"])), "constant"),
    ],
)
def test_a_file_that_is_no_such_network_is_named(tmp_path: Path, content: bytes | None, said: str) -> None:
    path = tmp_path / "own.onnx"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(ValueError, match=said) as error:
        MaskNetwork(path)
    assert str(path) in str(error.value)
    assert "accepted: an ONNX file" in str(error.value)


@pytest.mark.parametrize(("ground", "pad"), [((70, 110, 60), (235, 235, 230)), ((200, 190, 170), (190, 30, 30))])
def test_the_network_of_the_package_finds_a_pad_and_no_other(ground: tuple[int, ...], pad: tuple[int, ...]) -> None:
    inside, random = polygon(CORNERS), np.random.default_rng(0)
    picture = np.where(inside[..., None] > 0, np.array(pad), np.array(ground)) + random.normal(0, 6, (HIGH, WIDE, 1))
    bare = np.array(ground) + random.normal(0, 6, (HIGH, WIDE, 1))
    network = chosen("onnx")
    assert overlap(network(picture.clip(0, 255).astype(np.uint8)), inside) > 0.9
    assert network(bare.clip(0, 255).astype(np.uint8)).mean() < 0.001


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("apriltag:36h12", "family of AprilTags is '36h12'; accepted: 16h5"),
        ("apriltag", "family of AprilTags is ''"),
        ("apriltag:36h11:587", "ID of an AprilTag is 587; accepted: 0 to 586 of family 36h11"),
        ("apriltag:36h11:", "AprilTag is ''; accepted: ID or IDxFACTOR"),
        ("apriltag:36h11:-1", "AprilTag is '-1'"),
        ("apriltag:36h11:1x0.5", "factor of AprilTag 1 is 0.5; accepted: 1 to 20"),
        ("apriltag:36h11:1x2,1", "AprilTag 1 is there twice"),
        ("colour:1,2,3", "bounds of the colour are '1,2,3'; accepted: six numbers"),
        ("colour:0,0,0,361,100,100", "upper hue of the colour is 361; accepted: 0 to 360"),
        ("colour:0,nan,0,0,100,100", "lower saturation of the colour is nan"),
        ("colour:0,0,60,0,100,50", "lower value of the colour is 60; accepted: at most the upper one, 50"),
        ("aprltag:36h11", "aprltag.*did you mean 'apriltag'"),
    ],
)
def test_what_is_wrong_with_a_segmenter_is_named(text: str, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        chosen(text)


def test_the_same_picture_gives_the_same_mask() -> None:
    picture = tag(7)
    first, second = (chosen("apriltag:36h11:7")(picture) for _ in range(2))
    assert np.array_equal(first, second)
