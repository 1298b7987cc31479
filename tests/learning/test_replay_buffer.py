"""What off-policy methods keep."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from e2efly.learning.replay_buffer import Places, Ring
from e2efly.runs import presets


def rows(*values: int) -> dict[str, jax.Array]:
    return {"a": jnp.array(values), "b": jnp.array(values, jnp.float32)[:, None] * jnp.ones((1, 3))}


def test_a_ring_overwrites_the_oldest_rows() -> None:
    ring = Ring.of(rows(0), 6)
    for i in range(0, 10, 2):
        ring = ring.filled(rows(i, i + 1))
    assert sorted(np.asarray(ring.data["a"]).tolist()) == [4, 5, 6, 7, 8, 9]
    assert int(ring.written) == 10


def test_only_what_was_written_is_drawn_and_all_of_it() -> None:
    ring = Ring.of(rows(0), 64).filled(rows(7, 8, 9))
    drawn = ring.drawn(jax.random.key(0), 300)
    assert set(np.asarray(drawn["a"]).tolist()) == {7, 8, 9}
    np.testing.assert_array_equal(drawn["b"][:, 0], drawn["a"])  # rows stay together


def test_places_come_from_all_times_and_shared_parts_from_the_newest() -> None:
    def visited(time: int) -> tuple[dict[str, jax.Array], jax.Array, jax.Array]:
        here = jnp.arange(4) + 10.0 * time
        return {"x": here, "clock": jnp.float32(time)}, here[:, None], jnp.zeros((4, 0))

    places = Places.of(visited(0), 3)
    for time in (1, 2, 3, 4):
        places = places.filled(visited(time))
    draws = [places.drawn(jax.random.key(i)) for i in range(40)]
    seen = {float(x) for state, _, _ in draws for x in state["x"]}
    assert seen == {10.0 * t + i for t in (2, 3, 4) for i in range(4)}
    for state, observation, memory in draws:
        np.testing.assert_array_equal(observation[:, 0], state["x"])
        assert float(state["clock"]) == 4 and memory.shape == (4, 0)


@pytest.mark.parametrize(("field", "value"), [("buffer", 1000), ("places", 100), ("buffer", 0), ("fits", 0)])
def test_a_buffer_that_does_not_fit_the_updates_is_named(field: str, value: int) -> None:
    config = presets.preset("hover", "abpt")
    with pytest.raises(ValueError, match=f"algo.{field} is {value}"):
        presets.check(dataclasses.replace(config, algo=dataclasses.replace(config.algo, **{field: value})))
