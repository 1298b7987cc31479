"""One control step: batching, precision, compilation, wrong options."""

from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from e2efly.control import COMMAND_MODES
from e2efly.simulation.physics import INTEGRATORS, Physics, State, step
from e2efly.vehicles.vehicle import Vehicle

N = 6


@pytest.fixture(scope="module")
def flown() -> Callable[..., State]:
    return jax.jit(step)


@pytest.fixture
def commands() -> np.ndarray:
    return np.random.default_rng(0).normal([9.81, 0, 0, 0], [3, 2, 2, 1], (N, 4))


@pytest.fixture
def plants(vis_r: Vehicle) -> Vehicle:
    """A different vehicle in each row."""
    factor = np.random.default_rng(1).uniform(0.8, 1.2, N)
    return jax.tree.map(lambda x: np.multiply.outer(factor, x), vis_r)


def row(tree: object, i: int) -> object:
    return jax.tree.map(lambda x: x[i], tree)


def close(a: State, b: State, atol: float) -> None:
    jax.tree.map(lambda x, y: np.testing.assert_allclose(x, y, rtol=atol, atol=atol), a, b)


@pytest.mark.usefixtures("x64")
def test_a_batch_is_its_rows(
    vis_r: Vehicle, plants: Vehicle, commands: np.ndarray, random_state: Callable[..., State], flown: Callable
) -> None:
    physics, state = Physics.of(vis_r, dtype=np.float64), random_state(2, (N,))
    wind = np.random.default_rng(3).normal(size=(N, 3))
    previous, switch = commands[::-1], np.linspace(0, 1 / 30, N)
    whole = flown(physics, plants, state, commands, previous=previous, switch_time=switch, wind=wind)
    for i in range(N):
        alone = flown(
            physics, row(plants, i), row(state, i), commands[i],
            previous=previous[i], switch_time=switch[i], wind=wind[i],
        )  # fmt: skip
        close(row(whole, i), alone, 1e-12)


@pytest.mark.usefixtures("x64")
def test_leading_axes_of_any_rank(
    vis_r: Vehicle, commands: np.ndarray, random_state: Callable[..., State], flown: Callable
) -> None:
    physics, state = Physics.of(vis_r, dtype=np.float64), random_state(2, (N,))
    whole = flown(physics, vis_r, state, commands)
    shaped = flown(physics, vis_r, jax.tree.map(lambda x: x.reshape(2, 3, -1), state), commands.reshape(2, 3, 4))
    assert shaped.position.shape == (2, 3, 3)
    assert shaped.rotor_speed.shape == (2, 3, 4)
    close(jax.tree.map(lambda x: x.reshape(N, -1), shaped), whole, 1e-12)
    alone = flown(physics, vis_r, row(state, 4), commands[4])
    assert alone.quaternion.shape == (4,)
    close(alone, row(whole, 4), 1e-12)
    mapped = jax.jit(jax.vmap(lambda s, c: step(physics, vis_r, s, c)))(state, commands)
    close(mapped, whole, 1e-12)


@pytest.mark.usefixtures("x64")
def test_compiled_or_not(
    vis_r: Vehicle, commands: np.ndarray, random_state: Callable[..., State], flown: Callable
) -> None:
    physics, state = Physics.of(vis_r, largest_step=0.04, dtype=np.float64), random_state(2, (N,))
    with jax.disable_jit():
        plain = step(physics, vis_r, state, jnp.asarray(commands))
    close(flown(physics, vis_r, state, commands), plain, 1e-12)


@pytest.mark.parametrize("mode", ["rotor_thrust", "ctbr", "position"])
def test_single_precision_is_near_double(
    mode: str, vis_r: Vehicle, random_state: Callable[..., State], flown: Callable
) -> None:
    rng = np.random.default_rng(4)
    command = {"rotor_thrust": rng.uniform(1, 3, (N, 4)), "ctbr": rng.normal([10, 0, 0, 0], 1, (N, 4))}.get(
        mode, rng.normal([0, 0, 0, 0], 0.3, (N, 4))
    )
    with jax.enable_x64(True):
        exact = flown(Physics.of(vis_r, mode, dtype=np.float64), vis_r, random_state(5, (N,)), command)
        exact = jax.tree.map(np.asarray, exact)
    physics = Physics.of(vis_r, mode)
    single = flown(physics, physics.nominal, random_state(5, (N,)), jnp.asarray(command))
    for a, b in zip(jax.tree.leaves(single), jax.tree.leaves(exact), strict=True):
        assert a.dtype == np.float32
        np.testing.assert_allclose(a, b, rtol=1e-5, atol=1e-4)


@pytest.mark.usefixtures("x64")
def test_the_new_command_takes_over_at_the_switch(
    vis_r: Vehicle, commands: np.ndarray, random_state: Callable[..., State], flown: Callable
) -> None:
    physics, state, other = Physics.of(vis_r, dtype=np.float64), random_state(6, (N,)), commands[::-1]
    period = physics.control_period

    def at(when: float) -> State:
        return flown(physics, vis_r, state, commands, previous=other, switch_time=jnp.full(N, when))

    close(at(0.0), flown(physics, vis_r, state, commands), 1e-13)
    close(at(period), flown(physics, vis_r, state, other), 1e-13)
    # in the middle of a step of 7 sub-steps: three of the old, half of each, three of the new
    parts = Physics.of(vis_r, control_rate=7 * 30, dtype=np.float64)
    assert (physics.substeps, parts.substeps) == (7, 1)
    by_hand = state
    for command in [other] * 3 + [(commands + other) / 2] + [commands] * 3:
        by_hand = flown(parts, vis_r, by_hand, command)
    close(at(period / 2), by_hand, 1e-11)


@pytest.mark.parametrize(
    ("rate", "largest_step", "substeps"),
    [(30.0, 0.005, 7), (100.0, 0.005, 2), (200.0, 0.005, 1), (50.0, 0.005, 4), (None, 1.0, 1)],
)
def test_as_few_substeps_as_keep_the_largest_step(
    rate: float | None, largest_step: float, substeps: int, vis_r: Vehicle
) -> None:
    physics = Physics.of(vis_r, control_rate=rate, largest_step=largest_step)
    assert physics.substeps == substeps
    assert physics.control_period == 1 / (rate or 30.0)


def test_wrong_options(vis_r: Vehicle) -> None:
    with pytest.raises(ValueError, match=r"unknown command mode 'ctbs'; did you mean 'ctbr'\? \(there are: acc"):
        Physics.of(vis_r, "ctbs")
    with pytest.raises(ValueError, match=r"unknown integrator 'rk5'; did you mean 'rk4'.*euler, rk3, rk4, semi"):
        Physics.of(vis_r, integrator="rk5")
    for bad in (0.0, -30.0, float("nan"), float("inf")):
        with pytest.raises(ValueError, match=f"control_rate is {bad}; accepted: a positive number"):
            Physics.of(vis_r, control_rate=bad)
        with pytest.raises(ValueError, match=f"largest_step is {bad}; accepted: a positive number"):
            Physics.of(vis_r, largest_step=bad)


def test_registries_have_the_papers_entries() -> None:
    assert set(INTEGRATORS) == {"euler", "semi_implicit", "rk3", "rk4"}
    assert list(COMMAND_MODES) == [mode.name for mode in COMMAND_MODES.values()]
    assert len(COMMAND_MODES) == 8
