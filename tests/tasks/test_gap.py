"""The narrow gap: who fits through the slit, how it is judged, what it offers to the reward."""

import dataclasses
import math
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from e2efly.control.vectors import rotate, unrotate
from e2efly.environment import random_key
from e2efly.simulation import rewards
from e2efly.simulation.physics import State
from e2efly.simulation.physics.rotation import from_euler, multiply
from e2efly.simulation.scenes.scene import WALL, clearance
from e2efly.tasks.gap import GapConfig
from e2efly.tasks.gap.goal import GapMemory
from e2efly.tasks.gap.world import Gap
from e2efly.tasks.task import Outcome, Shape, at_rest

SHAPE = Shape(0.05, 0.12)
PERIOD = 1 / 30
SPEED = 3.0
STEEP = math.pi / 4
LATER, NOW = jnp.zeros(1, bool), jnp.ones(1, bool)


def make(**changes: Any) -> Gap:
    return Gap.of(GapConfig(**changes), SHAPE, PERIOD, 7)


def slit(roll: float, yaw: float = 0.0, passed: bool = False) -> GapMemory:
    turn = from_euler(jnp.array([roll]), jnp.zeros(1), jnp.array([yaw]))
    return GapMemory(jnp.array([[3.0, 0.0, 2.0]]), turn, jnp.array([passed]))


def at(memory: GapMemory, place: Any, roll: float, pitch: float = 0.0, yaw: float = 0.0) -> State:
    """At a place of the slit's frame, attitude relative to the upright wall, flying through at 3 m/s."""
    place = jnp.asarray([place], jnp.float32)
    wall = jnp.arctan2(*(2 * rotate(memory.quaternion, jnp.array([[1.0, 0, 0]]))[:, i] for i in (1, 0)))
    turn = multiply(
        from_euler(jnp.zeros(1), jnp.zeros(1), wall), from_euler(*(jnp.array([x]) for x in (roll, pitch, yaw)))
    )
    through = rotate(memory.quaternion, jnp.array([[1.0, 0.0, 0.0]]))
    return dataclasses.replace(
        at_rest(memory.centre + rotate(memory.quaternion, place)), velocity=SPEED * through, quaternion=turn
    )


@jax.jit
def flight(task: Gap, memory: GapMemory, first: State) -> tuple[GapMemory, Outcome]:
    """Ten steps straight on."""

    def step(carry: tuple[GapMemory, State], i: Any) -> tuple[tuple[GapMemory, State], Outcome]:
        memory, before = carry
        after = dataclasses.replace(before, position=before.position + PERIOD * before.velocity)
        memory, out = task.advance(memory, before, after, (i + 1) * jnp.full(1, PERIOD), LATER)
        return (memory, after), out

    (memory, _), out = jax.lax.scan(step, (memory, first), jnp.arange(10))
    return memory, out


def crosses(
    gap_roll: float, roll: float, y: float = 0.0, z: float = 0.0, wall_yaw: float = 0.0, **attitude: float
) -> tuple[bool, bool]:
    """Whether it is through, and whether it touched."""
    memory = slit(gap_roll, wall_yaw)
    memory, out = flight(make(), memory, at(memory, (-0.5, y, z), roll, **attitude))
    return bool(memory.passed[0]), bool(out.crashed.any())


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("wall_yaw", [0.0, 0.3])
def test_only_a_banked_vehicle_fits(side: int, wall_yaw: float) -> None:
    assert crosses(side * STEEP, side * STEEP, wall_yaw=wall_yaw) == (True, False)
    assert crosses(side * STEEP, 0.0, wall_yaw=wall_yaw) == (True, True)
    assert crosses(side * STEEP, -side * STEEP, wall_yaw=wall_yaw) == (True, True)


def test_no_slit_that_is_drawn_lets_the_level_vehicle_through() -> None:
    least, most = GapConfig().roll
    assert crosses(least, 0.0)[1]
    assert crosses(-least, 0.0)[1]
    assert not crosses(most, most)[1]


@pytest.mark.parametrize(
    ("off", "touched"),
    [
        ((0.0, 0.03), False),  # body 0.05 and slit 0.09 to either side
        ((0.0, 0.05), True),
        ((0.0, -0.05), True),
        ((0.22, 0.0), False),  # 0.12 and 0.35
        ((0.24, 0.0), True),
        ((-0.24, 0.0), True),
    ],
)
def test_the_body_is_a_flat_cylinder(off: tuple[float, float], touched: bool) -> None:
    assert crosses(STEEP, STEEP, *off) == (True, touched)


@pytest.mark.parametrize(("error", "touched"), [(0.2, False), (0.6, True), (-0.6, True)])
def test_how_far_off_the_bank_may_be(error: float, touched: bool) -> None:
    """The half extent across the slit: 0.12 sin + 0.05 cos of the error; 0.09 is free."""
    assert crosses(0.5, 0.5 + error)[1] == touched


def test_what_is_in_the_wall_between_two_steps_only_is_seen() -> None:
    task, memory = make(), slit(STEEP)
    for roll, touched in ((0.0, True), (STEEP, False)):
        first = at(memory, (-0.3, 0.0, 0.0), roll)
        first = dataclasses.replace(first, velocity=first.velocity * 6)  # a step ends 0.3 m behind the wall
        after, out = flight(task, memory, first)
        assert (bool(after.passed[0]), bool(out.crashed[0, 0])) == (True, touched)


def test_missing_the_slit_or_going_round_the_wall_fails() -> None:
    task = make(collisions_end=False)
    for y in (1.0, 5.0):
        memory = slit(STEEP)
        memory, out = flight(task, memory, at(memory, (-0.5, y, 0.0), STEEP))
        assert not memory.passed[0]
        assert out.terminated.any()
        assert not out.success.any()


def test_success_is_the_point_behind_the_slit() -> None:
    """A metre straight on, from where it is."""
    for passed, x, y, good in ((True, 0.6, 0.0, True), (True, 0.6, 0.6, False), (False, 0.6, 0.0, False)):
        memory = slit(STEEP, passed=passed)
        out = flight(make(), memory, at(memory, (x, y, 0.0), 0.0))[1]
        assert bool(out.success.any()) == good
        assert not out.crashed.any()


def test_a_touch_spoils_the_step_and_ends_the_episode_where_it_is_to() -> None:
    for ends in (True, False):
        memory = slit(STEEP)
        out = flight(make(collisions_end=ends), memory, at(memory, (-0.5, 0.0, 0.0), 0.0))[1]
        assert out.crashed.any()
        assert bool(out.terminated.any()) == ends


def test_the_goal_moves_behind_the_slit_once_through() -> None:
    task, turned = make(), slit(STEEP, yaw=0.3)
    np.testing.assert_allclose(task.goal(turned, jnp.zeros(1)), turned.centre)
    behind = task.goal(dataclasses.replace(turned, passed=jnp.array([True])), jnp.zeros(1))
    np.testing.assert_allclose(behind, [[3 + 2 * math.cos(0.3), 2 * math.sin(0.3), 2.0]], rtol=1e-5)
    state = at(turned, (-1.0, 0.2, 0.1), 0.0)
    seen = task.observe(turned, jnp.zeros(1), state).reshape(4, 3)
    local = unrotate(jnp.broadcast_to(turned.quaternion, (4, 4)), seen)
    expected = [[1.0, -0.2, -0.1], [3.0, -0.2, -0.1], [1, 0, 0], [0, 0, 1]]
    np.testing.assert_allclose(local, expected, atol=1e-5)
    assert float(task.desired_yaw(turned, state)[0]) == pytest.approx(0.3, abs=1e-5)


@pytest.mark.parametrize(("pitch", "yaw"), [(0.0, 0.0), (0.4, 0.0)])
def test_roll_error_is_the_turn_about_the_way_through(pitch: float, yaw: float) -> None:
    task = make()
    for gap_roll, roll in ((0.5, 0.5), (0.5, -0.2), (-0.7, 0.3), (0.6, 0.0)):
        memory = slit(gap_roll, yaw=0.2)
        # turned about the way through after it pitched, so that pitch leaves the roll what it is
        turn = multiply(
            from_euler(jnp.array([roll]), jnp.zeros(1), jnp.array([0.2])),
            from_euler(jnp.zeros(1), jnp.array([pitch]), jnp.array([yaw])),
        )
        state = dataclasses.replace(at(memory, (-1, 0, 0), 0.0), quaternion=turn)
        assert float(task.roll_error(memory, state)[0]) == pytest.approx(roll - gap_roll, abs=1e-5)


def test_approaching_is_near_the_wall_until_the_tail_is_out() -> None:
    task, memory = make(), slit(0.6)
    for x, near in ((-1.8, False), (-1.4, True), (0.0, True), (0.15, True), (0.25, False)):
        still = dataclasses.replace(at(memory, (x, 0, 0), 0.6), velocity=jnp.zeros((1, 3)))
        assert bool(flight(task, memory, still)[1].signals["approaching"][0, 0]) == near


def test_ori4_has_a_finite_gradient_even_where_roll_is_undefined() -> None:
    """Nose straight up or down: thrust along the way through."""
    task, memory = make(), slit(0.6)

    @jax.jit
    @jax.value_and_grad
    def cost(quaternion: jax.Array) -> jax.Array:
        state = dataclasses.replace(at(memory, (0, 0, 0), 0.6), quaternion=quaternion)
        return rewards.ori4(task.roll_error(memory, state), NOW)[0]

    for pitch in (0.0, math.pi / 2, -math.pi / 2):
        assert np.isfinite(cost(from_euler(jnp.zeros(1), jnp.array([pitch]), jnp.zeros(1)))[1]).all()
    value, gradient = cost(from_euler(jnp.zeros(1), jnp.zeros(1), jnp.zeros(1)))
    assert float(value) == pytest.approx(-math.tan(0.6), rel=1e-4)
    assert float(gradient[0, 1]) == pytest.approx(2 / math.cos(0.6) ** 2, rel=1e-4)  # roll is twice q_x


def test_fit_charges_for_what_stands_out_of_the_slit() -> None:
    """Level in a slit at 45 degrees: only the ends stand out, by 0.12 sin + 0.05 cos - 0.09 m and less."""
    task, memory = make(), slit(STEEP)

    def cost(roll: float, x: float = 0.0) -> float:
        return float(rewards.fit(task.overhang(memory, at(memory, (x, 0.0, 0.0), roll)), 0.0)[0])

    assert float(task.overhang(memory, at(memory, (0.0, 0.0, 0.0), 0.0)).max()) == pytest.approx(
        (0.12 + 0.05) * math.sqrt(0.5) - 0.09, abs=1e-5
    )
    assert cost(STEEP) == 0.0
    assert cost(0.0) < cost(0.3) < -0.01
    assert cost(0.0, x=-0.5) == 0.0


def test_starts_are_those_of_their_seed_and_all_that_is_said() -> None:
    task, c, n = make(), GapConfig(), 400
    state, memory = task.start(random_key(1), n)
    again, _ = task.start(random_key(1), n)
    other, _ = task.start(random_key(2), n)
    np.testing.assert_array_equal(state.quaternion, again.quaternion)
    assert not np.array_equal(state.quaternion, other.quaternion)
    across = task.axes(memory)[:, 1]
    tilt = np.arccos(np.asarray(across[:, 2]))
    assert c.roll[0] - 1e-3 <= tilt.min() < c.roll[0] + 0.02
    assert c.roll[1] + 1e-3 >= tilt.max() > c.roll[1] - 0.02
    assert 0.4 < np.mean(across[:, 1] > 0) < 0.6
    assert float(memory.centre[:, 0].min()) >= c.distance[0] - 1e-4
    scene = task.scene(memory)
    assert (scene.solids["gate"].label == WALL).all()
    assert float(clearance(scene, state.position, jnp.zeros(n)).min()) > SHAPE.radius


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"opening": (0.7, 0.1)}, r"task.opening is \(0.7, 0.1\); accepted: more than the vehicle's \(0.24, 0.1\) m"),
        ({"opening": (0.2, 0.2)}, "task.opening is"),
        ({"altitude": 0.8}, "task.altitude is 0.8; accepted: more than .* 0.85 m"),
    ],
)
def test_a_slit_that_cannot_be_flown_is_named(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        make(**changes)
