"""The drawing for whoever builds a vehicle: its motors are where the mixer has them."""

import math
import re
from xml.etree import ElementTree

import numpy as np
import pytest
from docs.vehicle_drawing import ABOVE, Mounted, drawing

from e2efly.alignment.parts import read_parts
from e2efly.vehicles.loading import _HERE, load_vehicle
from e2efly.vehicles.vehicle import allocation_matrix

SVG = "{http://www.w3.org/2000/svg}"
AHEAD = Mounted("camera ahead: RealSense D435i", -0.35, (1.52, 1.01), "a task sees")


def drawn(*cameras: Mounted) -> ElementTree.Element:
    text = drawing(load_vehicle("vis_r"), "VIS-R", read_parts(_HERE / "parts" / "vis_r.toml"), cameras)
    return ElementTree.fromstring(text)


def test_the_motors_are_numbered_and_turn_as_the_mixer_has_them() -> None:
    """More torque about an axis is more force of the motors that stand, or turn, so in the drawing."""
    root, mixer = drawn(AHEAD), np.linalg.inv(allocation_matrix(load_vehicle("vis_r")))
    labels = {x.get("id"): x for x in root.iter(f"{SVG}text") if x.get("id")}
    place = np.array([[float(labels[f"motor-{k}"].get(key, "")) for key in "xy"] for k in range(1, 5)])
    left, forward = ABOVE[0] - place[:, 0], ABOVE[1] - place[:, 1]
    arcs = [x.get("d") for x in root.iter(f"{SVG}path")]
    clockwise = np.array([int(re.search(r" 0 1 ([01]) ", arc).group(1)) for arc in arcs])
    assert len(arcs) == 4
    for axis, more in enumerate((left > 0, forward < 0, clockwise == 1)):
        assert np.array_equal(mixer[:, 1 + axis] > 0, more)


def test_a_camera_is_drawn_where_it_looks_and_must_be_a_part() -> None:
    part = next(p for p in read_parts(_HERE / "parts" / "vis_r.toml") if p.name == AHEAD.part)
    corners = next(x for x in drawn(AHEAD).iter(f"{SVG}polygon") if x.get("fill-opacity") == "0.12").get("points")
    apex, *ends = np.array([[float(v) for v in corner.split(",")] for corner in corners.split()])
    axis = np.mean(ends, axis=0) - apex
    assert math.isclose(math.atan2(-axis[1], axis[0]), 0.35, abs_tol=0.01)
    opening = np.diff([math.atan2(-(e - apex)[1], (e - apex)[0]) for e in ends])
    assert math.isclose(abs(float(opening[0])), 1.01, abs_tol=0.01)
    assert np.allclose(part.turn[:, 0], [math.cos(0.35), 0, math.sin(0.35)], atol=1e-3), (
        "the part is tilted as it looks"
    )
    with pytest.raises(ValueError, match=r"camera 'x' is not in the list of parts; accepted: frame"):
        drawn(Mounted("x", 0.0, (1.0, 1.0), ""))


def test_every_part_has_its_line() -> None:
    texts = ["".join(x.itertext()) for x in drawn(AHEAD).iter(f"{SVG}text")]
    for number, part in enumerate(read_parts(_HERE / "parts" / "vis_r.toml"), 1):
        assert any(text.startswith(f"{number}  {part.name}") for text in texts)
    assert any("20° up; a task sees 87° x 58°" in text for text in texts)
