"""Two vehicles through the real firmware at once, each among the other."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from e2efly.policy.loader import load_policy
from e2efly.tasks.swap.goal import SwapRoute
from e2efly.validation import firmware_program
from e2efly.validation.formation import fly_formation
from e2efly.vehicles.loading import load_vehicle


@pytest.mark.whole
def test_two_vehicles_exchange_their_places_beside_each_other(policy_of: Callable[..., Path]) -> None:
    vehicle, policy = load_vehicle("vis_r"), load_policy(policy_of("swap"))
    starts = [np.array([-0.6, 0.4, 1.5]), np.array([0.6, -0.4, 1.5])]
    places = [(0.6, 0.4, 1.5), (-0.6, -0.4, 1.5)]
    routes = [SwapRoute(target=place, outside=True) for place in places]
    flight = fly_formation(firmware_program.chosen(), policy, vehicle, routes, starts, 4.0, seed=3)
    assert flight.complete == (True, True), flight.modes
    assert max(flight.error) < 0.15
    assert 0.6 < flight.nearest < 0.9  # they pass each other 0.8 m apart
    assert flight.track.shape[1:] == (2, 3)
    np.testing.assert_allclose(flight.track[-1], places, atol=0.15)
