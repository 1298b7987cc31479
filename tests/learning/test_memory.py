"""What a policy with a GRU learns from: pieces of a rollout, and a probe that only a memory solves."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jaxtyping import Array

import e2efly
from e2efly.config import NetworkConfig, PPOConfig
from e2efly.environment import Step, random_key
from e2efly.learning.algorithm import TrainState, make_algorithm
from e2efly.learning.devices import OWN, on_each, own, stacked
from e2efly.learning.networks import Actor
from e2efly.learning.ppo import PPOSamples, in_pieces, log_prob, means
from e2efly.learning.setup import Setup
from tests.learning.probe import Probe, ProbeState

CONFIG = PPOConfig(
    envs=64, horizon=16, minibatch=256, sequence=8, epochs=4, learning_rate=1e-2, learning_rate_end=1e-3, gamma=0.5
)


class Recall(Probe):
    """Shows +1 or -1 in the first step of four; each step pays for an action of half of that."""

    def reset(self, key: Array, n: int) -> tuple[ProbeState, Array]:
        state, _ = super().reset(key, n)
        seeds = jax.random.uniform(key, (n,), minval=0.1, maxval=0.9)
        state = dataclasses.replace(
            state, vehicle=dataclasses.replace(state.vehicle, position=jnp.tile(seeds[:, None], (1, 3)))
        )
        return state, self.shown(state)

    @staticmethod
    def cue(state: ProbeState) -> Array:
        return jnp.where(state.vehicle.position[:, 0] > 0.5, 1.0, -1.0)

    def shown(self, state: ProbeState) -> Array:
        cue = jnp.where(state.count == 0, self.cue(state), 0.0)
        return self._observe(cue.shape[0]).at[:, :3].set(cue[:, None])

    def step(
        self, state: ProbeState, action: Array, *, restart: bool = True, privileged: bool = False
    ) -> tuple[ProbeState, Step]:
        reached, out = super().step(state, action, restart=restart, privileged=privileged)
        wanted = 0.5 * self.cue(state)[:, None] * jnp.ones(4)
        out = dataclasses.replace(out, reward=-jnp.sum((action - wanted) ** 2, axis=-1))
        last = reached.vehicle.position
        drawn = jnp.where(out.done[:, None], 3.99 * last * (1 - last), last)  # the logistic map: as good as random
        reached = dataclasses.replace(reached, vehicle=dataclasses.replace(reached.vehicle, position=drawn))
        return reached, dataclasses.replace(out, observation=self.shown(reached))


def paid(recurrent: int) -> float:
    """The mean reward of the last rollouts."""
    probe, algorithm = (
        Recall(),
        make_algorithm(CONFIG, Actor.of(Probe.fields, (), NetworkConfig((16,), "tanh", recurrent=recurrent))),
    )
    parameters = jax.tree.map(jnp.asarray, algorithm.init(probe, CONFIG, 0))  # type: ignore[arg-type]
    first = probe.reset(random_key(0), CONFIG.envs)
    memory = algorithm.actor.memory(CONFIG.envs)
    state = TrainState(parameters, algorithm.optimizer(CONFIG, parameters), *first, memory, random_key(1))

    def run(state: TrainState) -> Array:
        def update(state: TrainState, i: Array) -> tuple[TrainState, Array]:
            state, metrics = algorithm.update(probe, CONFIG, state, i / 150)  # type: ignore[arg-type]
            return state, metrics["reward"]

        return jax.lax.scan(update, own(state), jnp.arange(150))[1][None]

    return float(jnp.mean(on_each(run, 1, (OWN,), OWN)(stacked(state))[0, -10:]))


@pytest.mark.whole
def test_ppo_learns_to_remember() -> None:
    """Without a memory three steps of four are guessed: 4 * 0.25 * 3 / 4 = 0.75 is lost."""
    assert paid(recurrent=8) > -0.25
    assert paid(recurrent=0) < -0.7


def test_the_pieces_act_as_the_rollout_did_and_the_gradient_goes_back_to_their_first_step() -> None:
    config = e2efly.preset("hover", "ppo", "nominal")
    config = dataclasses.replace(
        config,
        task=dataclasses.replace(config.task, episode_s=0.5, hold_s=0.0),  # new starts within the pieces
        algo=PPOConfig(envs=8, horizon=32, minibatch=64, sequence=8),
        network=NetworkConfig((8,), recurrent=4),
    )
    setup = Setup.of(config)
    parameters = setup.algorithm.init(setup.env, config.algo, 0)
    head = [(3.0 * w, b) for w, b in parameters.policy.head]
    parameters = dataclasses.replace(parameters, policy=dataclasses.replace(parameters.policy, head=head))
    env, observation = setup.env.reset(random_key(0), 8)
    state = TrainState(parameters, None, env, observation, setup.actor.memory(8), random_key(0))

    def flown(state: TrainState) -> PPOSamples:
        rollout = setup.algorithm._rollout  # type: ignore[attr-defined]
        return stacked(rollout(setup.env, config.algo, own(state), random_key(1))[0])

    samples = jax.tree.map(lambda x: x[0], on_each(flown, 1, (OWN,), OWN)(stacked(state)))
    assert bool(samples.done[:-1].any())
    pieces = in_pieces(samples, 8)
    batch = jax.tree.map(lambda x: x.reshape(-1, *x.shape[2:]), pieces)
    z = (batch.acted.action - means(setup.actor, parameters.policy, batch)) * np.exp(-parameters.log_std)
    np.testing.assert_allclose(log_prob(z, parameters.log_std), batch.log_prob, atol=1e-4)

    def last(features: Array) -> Array:
        changed = dataclasses.replace(batch, acted=dataclasses.replace(batch.acted, features=features))
        return jnp.sum(means(setup.actor, parameters.policy, changed)[:, -1])

    slope = jnp.abs(jax.grad(last)(batch.acted.features)[:, 0]).sum(axis=-1)
    ended = np.asarray(batch.done[:, :-1].any(axis=1))
    assert np.all(np.asarray(slope)[ended] == 0)  # an episode knows nothing of the one before
    assert np.all(np.asarray(slope)[~ended] > 0)


@pytest.mark.parametrize(("sequence", "minibatch"), [(24, 256), (16, 8)])
def test_pieces_that_fill_no_rollout_or_minibatch_are_refused(sequence: int, minibatch: int) -> None:
    config = dataclasses.replace(CONFIG, sequence=sequence, minibatch=minibatch)
    algorithm = make_algorithm(config, Actor.of(Probe.fields, (), NetworkConfig((16,), recurrent=4)))
    with pytest.raises(ValueError, match=rf"algo\.sequence is {sequence}; accepted with a GRU: a divisor of"):
        algorithm.init(Probe(), config, 0)  # type: ignore[arg-type]
