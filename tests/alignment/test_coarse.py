"""A vehicle far from its file is found, too: the fit begins near it."""

import dataclasses

import numpy as np

from e2efly.alignment.coarse import begin
from e2efly.alignment.model import Model
from e2efly.alignment.windows import cut
from tests.alignment.flights import FILE, flown

FAR = dataclasses.replace(
    FILE,
    mass=1.25 * FILE.mass,
    thrust_map=0.8 * FILE.thrust_map,
    rotor_thrust_max=0.8 * FILE.rotor_thrust_max,
    inertia=1.5 * FILE.inertia,
    motor_time_constant=1.6 * FILE.motor_time_constant,
    latency=FILE.latency + 0.03,
)


def test_the_search_ends_near_a_vehicle_that_is_far_from_its_file() -> None:
    record = flown(FAR, 8.0)
    model = Model.of(dataclasses.replace(FILE, mass=FAR.mass), "command", FILE)
    p = dict(zip((u.name for u in model.unknowns), begin(model, cut(record, "command", 0)), strict=True))
    assert np.isclose(p["thrust"], np.log(0.8), atol=0.1)
    assert np.isclose(p["latency"], 0.03, atol=0.011)
    assert np.isclose(p["inertia_x"], np.log(1.5), atol=0.2)
    assert p["drag_linear_z"] == 0.0  # not searched: the fit finds it from there
