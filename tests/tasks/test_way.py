"""Which way is open among trunks."""

import math
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from e2efly.scenes.scene import Solids
from e2efly.tasks.way import FAN, HEADINGS, VIEW, open_heading

STEP = 2 * FAN / (HEADINGS - 1)


def trunks(*places: tuple[float, float], radius: float = 0.3, active: bool = True) -> Solids:
    centre = jnp.array([[(x, y, 3.0) for x, y in places]])
    return Solids.of("cylinder", centre, jnp.array([radius, 3.0]), active=jnp.full((1, len(places)), active))


def angle(trees: Solids, bearing: float = 0.0, place: Any = (0.0, 0.0), **given: float) -> float:
    x, y = open_heading(trees, jnp.array([place]), jnp.array([bearing]), given.pop("room", 0.5), **given)[0]
    assert math.hypot(x, y) == pytest.approx(1.0, abs=1e-5)
    return math.atan2(y, x)


def test_with_nothing_ahead_the_bearing_is_open() -> None:
    for bearing in (0.0, 1.0, -2.5):
        assert angle(trunks((-2.0, 0.0), (0.0, 9.0), (0.0, -9.0)), bearing) == pytest.approx(bearing, abs=1e-5)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_trunk_is_passed_on_its_nearer_side_and_clear(side: float) -> None:
    turn = angle(trunks((3.0, -0.2 * side)))
    assert math.copysign(1.0, turn) == side
    past = 3.0 * math.sin(abs(turn)) + 0.2 * math.cos(turn)  # how far its axis is from the line flown along
    assert 0.8 < past < 0.8 + 2 * 3.0 * STEP


def test_a_fence_is_passed_through_its_gap() -> None:
    fence = [(3.0, float(y)) for y in np.arange(-6.0, 6.1, 0.5) if not 0.0 < y < 3.0]
    turn = angle(trunks(*fence))
    clear = [abs(y * math.cos(turn) - x * math.sin(turn)) for x, y in fence]
    assert min(clear) > 0.8
    assert 0.0 < 3.0 * math.tan(turn) < 3.0


def test_what_is_not_there_or_too_far_ahead_blocks_nothing() -> None:
    assert angle(trunks((3.0, 0.0), active=False)) == pytest.approx(0.0, abs=1e-5)
    assert angle(trunks((VIEW + 2.0, 0.0))) == pytest.approx(0.0, abs=1e-5)


def test_it_does_not_lead_over_the_side() -> None:
    assert angle(trunks((2.0, -0.1)), place=(0.0, 0.0)) > 0
    assert angle(trunks((2.0, 1.9)), place=(0.0, 2.0), side=2.0) < 0


def test_turning_the_world_turns_the_way() -> None:
    places = np.random.default_rng(0).uniform(-5, 5, (12, 2))
    turn = 0.7
    c, s = math.cos(turn), math.sin(turn)
    turned = places @ np.array([[c, s], [-s, c]])
    one, other = (angle(trunks(*map(tuple, p)), b) for p, b in ((places, 0.3), (turned, 0.3 + turn)))
    assert other == pytest.approx(one + turn, abs=1e-4)


def test_it_has_no_gradient() -> None:
    def first(y: jax.Array) -> jax.Array:
        return open_heading(trunks((3.0, 0.1)), jnp.stack([jnp.zeros(()), y])[None], jnp.zeros(1), 0.5)[0, 1]

    assert jax.grad(first)(jnp.float32(0.05)) == 0.0
