"""Several vehicles in one world: who is near, who touches whom, and the task in which they exchange their places."""

import dataclasses
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from e2efly.config import EnvConfig, RewardConfig
from e2efly.environment import Env, random_key
from e2efly.learning.devices import share
from e2efly.learning.onnx_export import contract_of
from e2efly.learning.setup import Setup
from e2efly.policy.others import FAR, nobody
from e2efly.runs import presets
from e2efly.simulation.physics import State
from e2efly.simulation.scenes.scene import gaps
from e2efly.tasks import company
from e2efly.tasks.route import fields_of
from e2efly.tasks.swap import SwapConfig
from e2efly.tasks.swap.goal import SwapGoal, SwapMemory
from e2efly.tasks.swap.pilot import way
from e2efly.tasks.task import Flier, at_rest

PERIOD = 1 / 30


def moving(position: Any, velocity: Any) -> State:
    """Level vehicles at places (n, 3) with velocities (n, 3)."""
    return dataclasses.replace(at_rest(jnp.asarray(position, jnp.float32)), velocity=jnp.asarray(velocity, jnp.float32))


def anywhere(n: int, seed: int = 0) -> State:
    rng = np.random.default_rng(seed)
    return moving(rng.normal(size=(n, 3)), rng.normal(size=(n, 3)))


def environment(**changes: Any) -> Env:
    reward = RewardConfig({"prog2": 1.0, "avoid": 1.0})
    return Env.of(SwapConfig(**changes), reward, EnvConfig(action_latency=(0.0, 0.0)))


class TestCompany:
    def test_the_nearest_are_those_of_the_same_world(self) -> None:
        agents, count, body = 5, 3, anywhere(20)
        found = company.nearest(body, agents, count)
        position, velocity = np.asarray(body.position), np.asarray(body.velocity)
        for i in range(20):
            others = [j for j in range(i // agents * agents, i // agents * agents + agents) if j != i]
            order = sorted(others, key=lambda j: np.linalg.norm(position[j] - position[i]))[:count]
            np.testing.assert_allclose(found.position[i], position[order], rtol=1e-6)
            np.testing.assert_allclose(found.velocity[i], velocity[order], rtol=1e-6)

    def test_who_is_not_there_is_far_away_and_at_rest(self) -> None:
        body = anywhere(4)
        found = company.nearest(body, 2, 3)
        above = np.asarray(found.position)[:, 1:] - np.asarray(body.position)[:, None]
        np.testing.assert_allclose(above, np.broadcast_to([0.0, 0.0, FAR], above.shape), atol=1e-5)
        assert not np.any(np.asarray(found.velocity)[:, 1:])

    def test_the_gap_to_come_is_that_of_straight_flight(self) -> None:
        two = moving([[0, 0, 0], [2, 0.3, 0]], [[1, 0, 0], [-1.0, 0, 0]])  # they pass each other after a second
        gaps = np.asarray(company.misses(two, 2, 0.24))
        assert gaps[0, 1] == gaps[1, 0] == pytest.approx(0.3 - 0.24, abs=1e-4) and gaps[0, 0] == FAR
        fleeing = company.misses(dataclasses.replace(two, velocity=-two.velocity), 2, 0.24)
        assert float(fleeing[0, 1]) == pytest.approx(np.hypot(2, 0.3) - 0.24, abs=1e-4)
        same = moving(np.zeros((2, 3)), np.zeros((2, 3)))
        slope = jax.grad(lambda p: jnp.sum(company.misses(dataclasses.replace(same, position=p), 2, 0.24)))
        assert np.all(np.isfinite(slope(same.position)))

    def test_all_others_are_all_but_oneself(self) -> None:
        body = anywhere(6)
        found = company.all_others(body, 3)
        np.testing.assert_array_equal(found.position[4], np.asarray(body.position)[[3, 5]])

    def test_what_is_seen_of_others_has_a_gradient(self) -> None:
        body = anywhere(4)

        def seen(position: jax.Array) -> jax.Array:
            others = company.nearest(dataclasses.replace(body, position=position), 4, 2)
            return jnp.sum(jnp.sin(others.offsets(dataclasses.replace(body, position=position))))

        slope, step = jax.grad(seen)(body.position), 1e-2
        for i, c in ((0, 0), (3, 2)):
            there = [seen(body.position.at[i, c].add(s)) for s in (step, -step)]
            assert slope[i, c] == pytest.approx(float(there[0] - there[1]) / (2 * step), abs=2e-3)

    @pytest.mark.parametrize("sideways, touch", [(0.0, True), (0.2, True), (0.3, False)])
    def test_vehicles_that_pass_each_other_within_a_step_touch(self, sideways: float, touch: bool) -> None:
        speed = 11.0
        ends = (np.array([[-0.37, 0, 0], [0.37, sideways, 0]]), np.array([[0.37, 0, 0], [-0.37, sideways, 0]]))
        assert min(np.linalg.norm(a[0] - a[1]) for a in ends) > 0.7  # neither end shows it
        way = np.array([[speed, 0, 0], [-speed, 0, 0]])
        before, after = (moving(place, way) for place in ends)
        found = company.collided(before, after, 0.74 / speed, 16, 2, 0.24)
        assert found.tolist() == [touch, touch]

    def test_vehicles_of_other_worlds_do_not_touch(self) -> None:
        same = moving([[0, 0, 0], [3, 0, 0], [0, 0, 0], [3, 0, 0]], np.zeros((4, 3)))
        assert not np.any(company.collided(same, same, PERIOD, 4, 2, 0.24))

    def test_a_third_vehicle_is_not_struck(self) -> None:
        three = moving([[0, 0, 0], [0.2, 0, 0], [3, 0, 0]], np.zeros((3, 3)))
        assert company.collided(three, three, PERIOD, 4, 3, 0.24).tolist() == [True, True, False]

    def test_others_are_solids_where_they_were(self) -> None:
        body = anywhere(6)
        others, time = company.all_others(body, 3), jnp.full(6, 2.0)
        solids = company.spheres(others, time, 0.12)
        np.testing.assert_allclose(solids.position(time), others.position, atol=1e-5)
        earlier = others.position - 0.04 * others.velocity
        np.testing.assert_allclose(solids.position(time - 0.04), earlier, atol=1e-5)

    def test_flags_are_of_the_world(self) -> None:
        flag = jnp.array([True, False, True, True, False, False])
        assert company.any_of_world(flag, 2).tolist() == [True, True, True, True, False, False]
        assert company.all_of_world(flag, 2).tolist() == [False, False, True, True, False, False]


class TestPilot:
    """The expert, as points that move as it says."""

    def test_nobody_near_is_the_straight_way(self) -> None:
        flier = Flier.usual(jnp.zeros((2, 3)), jnp.zeros((2, 3)))
        place = jnp.array([[3.0, 4.0, 0.0], [0.0, 0.0, 0.0]])
        found = way(nobody(flier.position, 2), flier, place, 1.0)
        np.testing.assert_allclose(found, [[0.6, 0.8, 0.0], [0.0, 0.0, 0.0]], atol=0.05)

    def test_two_that_meet_pass_on_the_right(self) -> None:
        position, velocity = jnp.array([[-1.0, 0, 2], [1.0, 0, 2]]), jnp.array([[1.0, 0, 0], [-1.0, 0, 0]])
        both = company.all_others(moving(position, velocity), 2)
        found = np.asarray(way(both, Flier.usual(position, velocity), position[::-1] * jnp.array([4.0, 1, 1]), 1.0))
        assert found[0, 1] < -0.2 and found[1, 1] > 0.2  # one flies east, the other west

    def test_eight_exchange_their_places_by_the_two_nearest(self) -> None:
        env, step = environment(), 0.1
        state, _ = env.reset(random_key(0), 128)
        position, velocity, place = state.vehicle.position, jnp.zeros((128, 3)), state.memory.place
        pilot = jax.jit(
            lambda body: way(company.nearest(body, 8, 2), Flier.usual(body.position, body.velocity), place, 1.1)
        )
        nearest = np.inf
        for _ in range(90):
            velocity = pilot(moving(position, velocity))
            position = position + step * velocity
            nearest = min(nearest, float(jnp.min(company.squared_distances(position, 8))) ** 0.5)
        assert nearest > 2 * float(env.task.shape.radius)
        assert float(jnp.max(jnp.linalg.norm(position - place, axis=-1))) < 0.1

    def test_it_commands_the_vehicle_towards_its_place(self) -> None:
        env = environment()
        state, _ = env.reset(random_key(0), 8)
        begun = jnp.linalg.norm(state.memory.place - state.vehicle.position, axis=-1)
        step = jax.jit(lambda state: env.step(state, env.expert_action(state), restart=False)[0])
        for _ in range(60):
            state = step(state)
        left = jnp.linalg.norm(state.memory.place - state.vehicle.position, axis=-1)
        assert np.all(np.asarray(begun - left) > 0.5)


class TestSwap:
    def test_each_goes_to_the_place_of_another(self) -> None:
        env = environment(agents=8)
        state, _ = env.reset(random_key(0), 800)
        start = np.asarray(state.vehicle.position).reshape(100, 8, 3)
        place = np.asarray(state.memory.place).reshape(100, 8, 3)
        for begun, wanted in zip(start, place, strict=True):
            match = np.linalg.norm(begun[:, None] - wanted[None], axis=-1) < 1e-5
            assert np.all(match.sum(0) == 1) and np.all(match.sum(1) == 1) and not match.trace()
            level = np.linalg.norm(begun[:, None, :2] - begun[None, :, :2], axis=-1) + 10 * np.eye(8)
            assert level.min() > 0.9 - 1e-5
        assert np.abs(start[..., :2]).max() <= 2.5 and np.abs(start[..., 2] - 2.0).max() <= 0.5

    def test_a_collision_ends_the_whole_world_and_no_other(self) -> None:
        env = environment(agents=2, apart=0.3)
        state, _ = env.reset(random_key(0), 4)
        position = jnp.array([[0, 0, 2.0], [0.1, 0, 2.0], [-2, 0, 2.0], [2, 0, 2.0]])
        state = dataclasses.replace(state, vehicle=dataclasses.replace(state.vehicle, position=position))
        reached, out = env.step(state, jnp.broadcast_to(env.hover, (4, 4)))
        assert out.terminated.tolist() == [True, True, False, False] and not np.any(out.success)
        assert reached.time.tolist() == pytest.approx([0.0, 0.0, PERIOD, PERIOD])  # it begins anew, together
        fresh = np.asarray(reached.memory.place)[:2]
        np.testing.assert_allclose(fresh, np.asarray(reached.vehicle.position)[[1, 0]], atol=1e-5)

    def test_training_goes_on_but_a_world_with_a_collision_never_succeeds(self) -> None:
        env = environment(agents=2, apart=0.3, collisions_end=False, episode_s=0.2, hold_s=0.0, radius=9.0)
        state, _ = env.reset(random_key(0), 4)
        position = jnp.array([[0, 0, 2.0], [0.1, 0, 2.0], [-2, 0, 2.0], [2, 0, 2.0]])
        state, out = dataclasses.replace(state, vehicle=dataclasses.replace(state.vehicle, position=position)), None
        for _ in range(6):
            state, out = env.step(state, jnp.broadcast_to(env.hover, (4, 4)), restart=False)
        assert out is not None and out.success.tolist() == [False, False, True, True]
        assert not np.any(out.terminated)

    def test_one_that_misses_its_place_fails_for_all(self) -> None:
        env = environment(agents=2, episode_s=0.2, hold_s=0.1)
        state, _ = env.reset(random_key(0), 2)
        there = state.memory.place.at[0].add(jnp.array([0.0, 0.0, 1.0]))
        state, out = dataclasses.replace(state, vehicle=dataclasses.replace(state.vehicle, position=there)), None
        for _ in range(6):
            state, out = env.step(state, jnp.broadcast_to(env.hover, (2, 4)), restart=False)
        assert out is not None and not np.any(out.success) and np.all(out.truncated)

    def test_flight_shows_what_training_showed(self) -> None:
        env = environment(agents=4, neighbours=2)
        state, observation = env.reset(random_key(2), 8)
        found = company.nearest(state.vehicle, 4, 2)
        world: Any = env.task
        for i in (0, 5):
            vehicle, others = jax.tree.map(lambda x: np.asarray(x)[i : i + 1], (state.vehicle, found))  # noqa: B023
            goal = SwapGoal(world.config, world.shape, world.control_period, world.checks)
            memory = SwapMemory(np.asarray(state.memory.place)[i : i + 1], np.zeros(1), others)
            shown = goal.observe(memory, np.zeros(1), vehicle)
            np.testing.assert_allclose(shown[0], observation[i, : shown.shape[1]], atol=1e-5)

    def test_by_depth_the_others_are_seen_and_not_told(self) -> None:
        """The preset `depth`: the image changes with the others, and the contract asks for no pose of theirs."""
        setup = Setup.of(presets.preset("swap", "bptt", "depth"))
        contract = contract_of(setup.env, setup.config)
        fields = [field.name for field in contract.observation]
        assert contract.others is None and contract.neighbours == 0 and len(contract.images) == 1
        assert fields == ["position_error", "attitude", "velocity", "body_rate", "past_actions"]
        assert fields_of(contract) == contract.observation[:1]
        state, observation = setup.env.reset(random_key(0), 8)
        assert observation.shape[1] == contract.observation_size
        alone = dataclasses.replace(state.memory, bodies=nobody(state.vehicle.position, 7))
        among = setup.env.look(state, jnp.ones(8, bool)).images[0]
        empty = setup.env.look(dataclasses.replace(state, memory=alone), jnp.ones(8, bool)).images[0]
        assert np.all(np.max(np.asarray(empty - among), axis=(1, 2)) > 0.3)

    @pytest.mark.parametrize("task", ["swap", "race_duel"])
    def test_what_the_options_hide_is_not_observed(self, task: str) -> None:
        config = presets.preset(task, "bptt")
        hides = dataclasses.replace(config.task, observes=("others", "attitude"))
        env = Env.of(hides, config.reward, config.env)
        assert [field.name for field in env.fields] == ["others", "attitude"]

    def test_the_reward_sees_the_others(self) -> None:
        env = environment(agents=2)
        state, _ = env.reset(random_key(0), 2)
        position = jnp.array([[0, 0, 2.0], [0.5, 0, 2.0]])
        state = dataclasses.replace(state, vehicle=dataclasses.replace(state.vehicle, position=position))
        reached, out = env.step(state, jnp.broadcast_to(env.hover, (2, 4)), restart=False)
        each = gaps(env.task.scene(reached.memory), reached.vehicle.position, reached.time)
        np.testing.assert_allclose(each[:, 1], 0.5 - 0.12, atol=1e-3)
        assert np.all(np.asarray(out.terms["avoid"]) < -0.1)

    def test_batches_are_whole_worlds(self) -> None:
        env = environment(agents=3)
        assert [env.whole(n, parts) for n, parts in ((1, 1), (250, 1), (9, 1), (10, 2))] == [3, 252, 9, 12]
        with pytest.raises(ValueError, match="n is 4 vehicles; accepted: a multiple of 3, the vehicles of a world"):
            env.reset(random_key(0), 4)
        with pytest.raises(ValueError, match=r"algo\.envs is 100; accepted: a multiple of 3"):
            share(100, None, None, 3)

    def test_abpt_is_refused(self) -> None:
        config = presets.preset("swap", "abpt")
        with pytest.raises(ValueError, match=r"algo is abpt and task.agents 8; accepted: one vehicle in a world"):
            Setup.of(config).parameters()

    @pytest.mark.parametrize(
        "changes, told",
        [
            ({"apart": 2.0}, r"task.apart is 2.0; accepted: at most 1.25 m"),
            ({"agents": 1}, r"task.agents is 1; accepted: .* 2 to 64"),
            ({"height": 3.0}, r"task.height is 3.0; accepted: less than 1.95 m"),
            ({"hold_s": 11.0}, r"task.hold_s is 11.0; accepted: 0 to task.episode_s, 10 s"),
        ],
    )
    def test_places_that_have_no_space_are_refused(self, changes: Any, told: str) -> None:
        with pytest.raises(ValueError, match=told):
            SwapConfig(**changes).check(30.0, 0.05)
