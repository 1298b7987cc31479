"""The ranges of vehicles: what of a vehicle is compared, and by how much it may differ."""

import dataclasses

import numpy as np
import pytest

from e2efly.config import EnvConfig
from e2efly.config.domain import Domain
from e2efly.environment.limits import vehicles_of
from e2efly.policy.contract import Contract
from e2efly.policy.loader import load_policy
from e2efly.vehicles.loading import load_vehicle
from e2efly.vehicles.posterior import Entry, Posterior
from e2efly.vehicles.vehicle import CONTROLLED, Vehicle, quantities, terms
from e2efly.vehicles.vehicle_domain import FELT, OF_MODE, drawn_domain, misfits, vehicle_domain

OWN = load_vehicle("vis_r")
HOVER = load_policy("vis_r/hover").contract
OF_CONTROLLER = {
    "thrust_map", "rotor_thrust_max", "rotor_speed_max", "rotor_speed_min",  # with the mass: hover_thrust
    "rotor_position", "rotor_spin",  # arm_x, arm_y; which way a rotor turns is the mixer's
    "attitude_gain", "velocity_gain", "position_gain", "tilt_max", "acceleration_max", "speed_max", "control_rate",
    "latency",  # the contract has its range
    "feet_height",  # the goals are told it
}  # fmt: skip


def changed(**factors: float) -> Vehicle:
    values = {name: np.asarray(getattr(OWN, name)) * factor for name, factor in factors.items()}
    return dataclasses.replace(OWN, name="mine", **values)


def test_each_entry_of_a_vehicle_file_is_compared_or_has_a_reason_not_to_be() -> None:
    always = {f.name for f in quantities()}
    assert always == {*FELT, *OF_CONTROLLER} and not set(FELT) & OF_CONTROLLER
    for names in OF_MODE.values():
        assert set(names) <= OF_CONTROLLER
    assert set(OF_MODE["position"]) < set(CONTROLLED)


@pytest.mark.parametrize(
    ("name", "inside", "beyond", "said"),
    [
        ("mass", 1.2, 1.3, "mass of vehicle 'mine' is 0.975 kg, 30 % more than the 0.75 kg of 'vis_r'; accepted: "),
        ("mass", 0.8, 0.7, "mass of vehicle 'mine' is 0.525 kg, 30 % less than the 0.75 kg of 'vis_r'"),
        ("inertia", 1.4, 1.6, "inertia_z of vehicle 'mine' is 0.00328 kg*m^2, 60 % more than"),
        ("motor_time_constant", 0.3, 0.1, "motor_time_constant of vehicle 'mine' is 0.0035 s, 90 % less than"),
        ("drag_linear", 1.8, 2.0, "drag_linear_x of vehicle 'mine' is"),
        ("drag_quadratic", 0.2, 0.0, "drag_quadratic_x of vehicle 'mine' is 0 N*s^2/m^2, 100 % less than"),
        ("torque_ratio", 1.2, 1.4, "torque_ratio of vehicle 'mine' is"),
        ("rate_gain", 0.6, 0.4, "rate_gain_y of vehicle 'mine' is 10 1/s, 60 % less than the 25 1/s of 'vis_r'"),
        ("body_rate_max", 1.5, 0.9, "body_rate_max_x of vehicle 'mine' is 9 rad/s, 10 % less than the 10 rad/s of"),
        ("radius", 0.5, 1.1, "radius of vehicle 'mine' is 0.132 m, 10 % more than the 0.12 m of 'vis_r'; "),
        ("rotor_position", 1.1, 1.2, "arm_x of vehicle 'mine' is 0.06364 m, 20 % more than the 0.05303 m of 'vis_r'"),
        ("rotor_thrust_max", 0.9, 0.7, "hover_thrust of vehicle 'mine' is 0.5132, 43 % more than the 0.3593 of"),
        ("latency", 1.5, 2.0, "latency of vehicle 'mine' is 0.12 s, "),
    ],
)  # fmt: skip
def test_a_policy_flies_what_it_was_trained_for_and_names_what_it_was_not(
    name: str, inside: float, beyond: float, said: str
) -> None:
    assert HOVER.refusals(changed(**{name: inside})) == ()
    reasons = HOVER.refusals(changed(**{name: beyond}))
    assert any(reason.startswith(said) for reason in reasons), reasons
    assert reasons[-1].endswith("by `e2efly train hover --vehicle FILE`, or that of any vehicle, any/hover")


def test_mass_and_thrust_are_judged_together() -> None:
    assert HOVER.refusals(changed(mass=1.2, rotor_thrust_max=1.3)) == ()
    (said,) = HOVER.refusals(changed(mass=1.2, rotor_thrust_max=0.9))
    assert said.startswith("hover_thrust of vehicle 'mine' is 0.479, 33 % more than")


def test_by_how_much_a_weighed_vehicle_differs_is_said() -> None:
    assert HOVER.differences(OWN) == HOVER.differences(dataclasses.replace(OWN, name="another")) == ()
    assert HOVER.differences(changed(mass=1.2)) == (
        "mass 0.9 kg: 20 % more than the 0.75 kg of vis_r; trained for 0.5625 to 0.9375 kg",
        "hover_thrust 0.4311: 20 % more than the 0.3593 of vis_r; trained for 0.2694 to 0.4491",
    )
    assert load_policy("any/hover").contract.differences(changed(mass=1.2)) == ()


def test_a_centre_of_mass_beside_the_middle_is_within_what_was_drawn() -> None:
    def placed(x: float, z: float = 0.0) -> Vehicle:
        return dataclasses.replace(OWN, name="mine", centre_of_mass=np.array([x, 0.0, z]))

    assert HOVER.refusals(placed(-0.005)) == ()
    assert HOVER.refusals(placed(0.007))[0].startswith("arm_x of vehicle 'mine' is 0.04603 to 0.06003 m, 13 % ")
    assert HOVER.refusals(placed(0.0, 0.01))[0].startswith("centre_of_mass_z of vehicle 'mine' is 0.01 m, more than")


@pytest.mark.parametrize("term", [f for f in terms() if f.name != "centre_of_mass"], ids=lambda f: f.name)
def test_a_term_that_the_training_did_not_have_is_refused_by_name(term: dataclasses.Field) -> None:
    value = np.tile([0.0, 0.0, 1.0], (4, 1)) if term.name == "rotor_axis" else np.full(term.metadata["shape"], 0.1)
    has = dataclasses.replace(OWN, name="mine", **{term.name: value})
    (said, *_) = HOVER.misfits(has)
    assert said.startswith(term.name) and said.endswith("accepted: a file without this entry")
    (said, *_) = misfits(vehicle_domain(has, "ctbr"), vehicle_domain(OWN, "ctbr"), "mine")
    assert said.startswith(f"vehicle 'mine' has no {term.name}")


def test_a_nominal_policy_flies_its_point_as_files_round_it() -> None:
    point = dataclasses.replace(HOVER, vehicles=drawn_domain(OWN, "ctbr", {}))
    assert point.refusals(changed(mass=1 + 4e-7)) == ()
    assert point.misfits(changed(mass=1.001))[0].endswith("accepted: 0.75 kg")
    assert point.differences(changed(mass=1.2))[0] == "mass 0.9 kg: 20 % more than the 0.75 kg of vis_r"


def test_what_a_command_means_is_compared_in_modes_of_the_cascade() -> None:
    def refused(mode: str) -> tuple[str, ...]:
        c = dataclasses.replace(HOVER, action=dataclasses.replace(HOVER.action, mode=mode))
        c = dataclasses.replace(c, vehicles=drawn_domain(OWN, mode, {}))
        return c.misfits(changed(velocity_gain=2.0, rotor_spin=-1.0))

    assert refused("ctbr") == refused("attitude") == ()
    assert refused("velocity")[0].startswith("velocity_gain_x of vehicle 'mine' is")
    assert refused("rotor_share")[0].startswith("rotor_spin_0 of vehicle 'mine' is")


def test_ranges_are_as_wide_above_the_vehicle_as_below() -> None:
    shares = {"mass": 0.2, "thrust_map": np.full(3, 0.1), "rotor_thrust_max": 0.1, "inertia": np.array([0.1, 0.2, 0.0])}
    known = {part.name: part for part in drawn_domain(OWN, "ctbr", shares, offset=0.004)}
    own = {part.name: part for part in vehicle_domain(OWN, "ctbr")}
    for name, part in known.items():
        assert (part.low + part.high) / 2 == pytest.approx((own[name].low + own[name].high) / 2)
    hover = own["hover_thrust"].low
    assert (known["mass"].low, known["mass"].high) == pytest.approx((0.6, 0.9))
    assert known["hover_thrust"].low == pytest.approx(hover * 0.8 / 1.1)  # light and strong; the narrower side
    assert [known[f"inertia_{x}"].high / own[f"inertia_{x}"].high for x in "xyz"] == pytest.approx([1.1, 1.2, 1.0])
    assert known["arm_x"].high - own["arm_x"].high == pytest.approx(0.004)


def test_the_ranges_travel_in_the_contract() -> None:
    assert Contract.from_json(HOVER.to_json()) == HOVER
    without: Domain | None = dataclasses.replace(HOVER, vehicles=None).vehicles
    assert without is None
    old = dataclasses.replace(HOVER, vehicles=None)
    assert Contract.from_json(old.to_json()) == old
    assert old.refusals(changed(mass=1.01))[0].startswith("vehicle 'mine' has hash ")


def test_an_identified_vehicle_has_the_ranges_of_its_widest_draws() -> None:
    entries = tuple(map(Entry.of, ("mass", "thrust_map", "inertia[0]", "latency")))
    posterior = Posterior(entries, np.diag([0.04, 0.02, 0.1, 0.002]))
    config = EnvConfig(randomize={"identified": 1.0, "rate_gain": 0.3})
    ranges = {part.name: part for part in vehicles_of(config, OWN, posterior)}
    own = {part.name: part.low for part in vehicle_domain(OWN, "ctbr")}
    low = {name: part.low / own[name] for name, part in ranges.items() if own[name]}
    assert low["mass"] == pytest.approx(np.exp(-0.1))
    assert low["inertia_x"] == pytest.approx(np.exp(-0.25)) and low["inertia_y"] == pytest.approx(1.0)
    assert low["rate_gain_x"] == pytest.approx(0.7)
    assert low["hover_thrust"] == pytest.approx(np.exp(-0.1) / (2 - np.exp(-0.05)))  # of the ceiling, too
    assert "latency" not in ranges  # the contract has the delays that were drawn
    wider = dataclasses.replace(config, randomize={**config.randomize, "mass": 0.2, "inertia": 0.5})
    low = {part.name: part.low / own[part.name] for part in vehicles_of(wider, OWN, posterior) if own[part.name]}
    assert low["mass"] == pytest.approx(0.8 * np.exp(-0.1))  # about what the file leaves open
    assert low["inertia_x"] == pytest.approx(0.5 * np.exp(-0.25)) and low["inertia_y"] == pytest.approx(0.5)
