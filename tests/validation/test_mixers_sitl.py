"""The firmware's own mixers for six and eight rotors: each rotor gets the output of its own motor."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from e2efly.commands.rehearsals import fly_whole
from e2efly.validation import firmware_program
from e2efly.validation.candidate import candidate
from e2efly.validation.rig import Rig
from e2efly.vehicles.loading import load_vehicle
from e2efly.vehicles.vehicle import allocation_matrix
from tests.validation.test_rig_sitl import Bench


@pytest.mark.whole(but=1)
@pytest.mark.parametrize("name", ["hexa", "octo"])
def test_the_rotors_give_the_torque_of_a_body_rate(name: str, tmp_path: Path) -> None:
    """About one axis alone, and upwards: the sum over the rotors, as the vehicle file has them."""
    vehicle = load_vehicle(name)
    wrench = allocation_matrix(vehicle)
    with Rig(firmware_program.chosen(), tmp_path, vehicle) as rig:
        bench = Bench(rig)
        bench.arm()
        rig.state = dataclasses.replace(rig.state, position=np.array([0.0, 0.0, 2.0]))
        rig.held = True  # the body does not follow, so the motors go on pushing
        bench.send(0.5, 0.4)
        level = rig.sitl.motors()[rig.motors]
        assert np.ptp(level) < 0.02
        for axis in range(3):
            bench.send(0.5, 0.4)
            bench.send(0.15, 0.4, tuple(np.eye(3)[axis] * 0.5))  # type: ignore[arg-type]
            torque = wrench[1:] @ (rig.sitl.motors()[rig.motors] - level) / np.abs(wrench[1:]).sum(1)
            assert torque[axis] > 0.005
            assert np.abs(np.delete(torque, axis)).max() < 0.2 * torque[axis]
        bench.client.link.close()


def test_a_hexacopter_flies_a_whole_flight_through_the_firmware() -> None:
    (flight,) = fly_whole(candidate("any/hover", "hexa"), load_vehicle("hexa"), 1, Console(quiet=True), 3)
    assert flight.complete
    assert flight.success
