"""Pictures of what a policy is shown: read again by OpenCV, and by the characters of the terminal."""

import dataclasses
from pathlib import Path

import cv2
import numpy as np

import e2efly
from e2efly.flight.sight.picture import HOLE, blocks, colours, write_png

DEPTH = e2efly.load_policy("avoid").contract.images[0]
COLOURS = dataclasses.replace(DEPTH, sees="rgb", encoding="none")
RNG = np.random.default_rng(0)


def test_a_png_is_what_the_network_is_shown(tmp_path: Path) -> None:
    image = RNG.uniform(0, 1, COLOURS.shape).astype(np.float32)
    path = tmp_path / "new" / "image.png"
    write_png(path, colours(image, COLOURS))
    read = cv2.imread(str(path))
    times = read.shape[0] // DEPTH.height
    assert read.shape == (times * DEPTH.height, times * DEPTH.width, 3)
    assert times >= 8
    for offset in (0, times - 1):
        np.testing.assert_allclose(read[offset::times, offset::times, ::-1] / 255, image, atol=0.5 / 255 + 1e-6)


def test_depth_is_bright_near_and_a_hole_has_a_colour_of_its_own() -> None:
    image = np.full(DEPTH.shape, 5.0, np.float32)
    image[0, :3] = (0.0, 1.0, DEPTH.reach_m[1])
    shown = colours(image, DEPTH)
    assert shown.dtype == np.uint8
    assert tuple(shown[0, 0]) == HOLE
    assert np.ptp(shown[0, 1]) == 0
    assert shown[0, 1, 0] > shown[1, 1, 0] > shown[0, 2, 0] == 0
    mask = dataclasses.replace(DEPTH, sees="mask", of="pad", encoding="none")
    np.testing.assert_array_equal(colours((image > 4).astype(np.float32), mask)[0, :3, 0], [0, 0, 255])


def test_a_character_is_two_pixels() -> None:
    pixels = RNG.integers(0, 256, (5, 8, 3)).astype(np.uint8)
    lines = blocks(pixels).plain.splitlines()
    assert lines == ["\u2580" * 8] * 3
    span = blocks(pixels).spans[0]
    assert str(span.style) == "rgb({},{},{}) on rgb({},{},{})".format(*pixels[0, 0], *pixels[1, 0])
    wide = blocks(np.zeros((12, 200, 3), np.uint8), columns=64).plain.splitlines()
    assert len(wide[0]) <= 64
