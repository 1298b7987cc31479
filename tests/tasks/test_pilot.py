"""Where one who knows every trunk flies."""

import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from e2efly.simulation.scenes.scene import Solids
from e2efly.tasks.avoid.pilot import FAN, best_heading
from e2efly.tasks.task import Flier

RADIUS = 0.12


def trunks(*places: tuple[float, float], radius: float = 0.3, active: bool = True) -> Solids:
    centre = jnp.array([[(x, y, 3.0) for x, y in places]])
    return Solids.of("cylinder", centre, jnp.array([radius, 3.0]), active=jnp.full((1, len(places)), active))


def heading(
    trees: Solids,
    bearing: float = 0.0,
    place: tuple[float, float] = (0.0, 0.0),
    velocity: tuple[float, float] = (5.0, 0.0),
    speed: float = 5.0,
    side: float = math.inf,
) -> float:
    place, velocity = (jnp.array([[*x, 0.0]]) for x in (place, velocity))
    return float(
        best_heading(trees, Flier.usual(place, velocity), jnp.array([bearing]), jnp.array([speed]), RADIUS, side)[0]
    )


def test_with_nothing_ahead_the_bearing_is_flown() -> None:
    for bearing in (0.0, 1.0, -2.5):
        velocity = (5 * math.cos(bearing), 5 * math.sin(bearing))
        behind = (-3 * math.cos(bearing), -3 * math.sin(bearing))
        assert heading(trunks(behind), bearing, velocity=velocity) == pytest.approx(bearing, abs=1e-5)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_trunk_is_passed_on_its_nearer_side(side: float) -> None:
    turn = heading(trunks((4.0, -0.2 * side)))
    assert math.copysign(1.0, turn) == side
    assert 0.1 < abs(turn) <= FAN


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_vehicle_keeps_to_the_side_that_it_moves_to(side: float) -> None:
    assert math.copysign(1.0, heading(trunks((4.0, 0.0)), velocity=(5.0, 1.5 * side))) == side


def test_the_faster_the_sooner_it_turns() -> None:
    tree = trunks((6.5, 0.05))
    assert heading(tree, velocity=(3.0, 0.0), speed=3.0) == pytest.approx(0.0, abs=1e-5)
    assert abs(heading(tree, velocity=(10.0, 0.0), speed=10.0)) > 0.1


def test_a_fence_is_passed_through_its_gap() -> None:
    fence = [(5.0, float(y)) for y in np.arange(-8.0, 8.1, 0.5) if not 1.0 < y < 4.0]
    assert 1.2 < 5.0 * math.tan(heading(trunks(*fence), velocity=(0.0, 0.0), speed=6.0)) < 4.5


def test_what_is_not_there_blocks_nothing() -> None:
    assert heading(trunks((3.0, 0.0), active=False)) == pytest.approx(0.0, abs=1e-5)


def test_it_does_not_lead_over_the_side() -> None:
    assert heading(trunks((4.0, -0.1))) > 0
    assert heading(trunks((4.0, 1.4)), place=(0.0, 1.5), side=2.0) < 0


def test_the_mirrored_world_is_flown_mirrored() -> None:
    places = np.random.default_rng(0).uniform((1, -5), (9, 5), (12, 2))
    seen = heading(trunks(*map(tuple, places)), velocity=(4.0, 1.0))
    mirrored = heading(trunks(*map(tuple, places * [1, -1])), velocity=(4.0, -1.0))
    assert mirrored == pytest.approx(-seen, abs=1e-5)


def test_a_vehicle_that_follows_it_passes_forests() -> None:
    rng, n, speed = np.random.default_rng(1), 60, 6.0
    places = np.concatenate([rng.uniform((3, -8, 3), (25, 8, 3), (n, 35, 3))])
    trees = Solids.of("cylinder", jnp.asarray(places), jnp.array([0.25, 3.0]), active=jnp.ones((n, 35), bool))
    level, ahead, commanded = jnp.zeros(n), jnp.zeros(n), jnp.full(n, speed)

    @jax.jit
    def fly(p: jax.Array, v: jax.Array) -> jax.Array:
        flier = Flier.usual(*(jnp.column_stack([x, level]) for x in (p, v)))
        return best_heading(trees, flier, ahead, commanded, RADIUS, 8.0)

    place, velocity, struck = np.zeros((n, 2)), np.tile([speed, 0.0], (n, 1)), np.zeros(n, bool)
    for _ in range(140):
        turn = np.asarray(fly(jnp.asarray(place), jnp.asarray(velocity)))
        change = (speed * np.stack([np.cos(turn), np.sin(turn)], axis=-1) - velocity) / 0.3
        velocity = velocity + change * (12 / np.maximum(np.linalg.norm(change, axis=1, keepdims=True), 12)) / 30
        place = place + velocity / 30
        struck |= (np.linalg.norm(places[:, :, :2] - place[:, None], axis=-1) < 0.25 + RADIUS).any(axis=1)
    assert (place[:, 0] > 22).all() and struck.mean() < 0.05


def test_it_hands_no_gradient_on() -> None:
    def turn(y: jax.Array) -> jax.Array:
        place = jnp.stack([jnp.zeros(()), y, jnp.zeros(())])[None]
        flier = Flier.usual(place, jnp.ones((1, 3)))
        return best_heading(trunks((4.0, 0.1)), flier, jnp.zeros(1), jnp.ones(1), RADIUS, 8.0)[0]

    assert jax.grad(turn)(jnp.float32(0.0)) == 0.0
