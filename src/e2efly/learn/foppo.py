"""PPO refined by first-order gradients: what noise explores is followed by the exact gradient of the same flights.

A rollout of the policy with noise is differentiated through physics, latency and policy. Its samples go through PPO's
epochs, which find ways that no gradient points to (round a tumble, past an event); then the policy takes one step along
the exact gradient of the rollout's reward and of the critic's value of where it ends, which says precisely how to fly
what was found.
"""

import dataclasses
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, PRNGKeyArray

from e2efly.config import FOPPOConfig
from e2efly.env import Env, EnvState
from e2efly.learn.algorithm import TrainState, annealed, ascended, at_rest, descend, ends, episode_metrics
from e2efly.learn.critic import gae, known, value
from e2efly.learn.networks import Actor, Weights
from e2efly.learn.ppo import PPO, Parameters, Samples, improve
from e2efly.learn.window import Flight, cut_off, flown


@dataclass(frozen=True)
class FOPPO:
    """The algorithm on one environment's shapes; its numbers come in with `config` at every call."""

    actor: Actor

    def init(self, env: Env, config: FOPPOConfig, seed: int) -> Parameters:
        """Fresh networks, made by NumPy."""
        return PPO(self.actor).init(env, config, seed)  # pyright: ignore[reportArgumentType]

    def optimizer(self, config: FOPPOConfig, parameters: Parameters) -> dict[str, Any]:
        """Adam at rest, of PPO's epochs and of the exact gradient."""
        return {"epochs": at_rest(config, parameters), "exact": at_rest(config, parameters.policy)}

    def replay(self, env: Env, config: FOPPOConfig, state: EnvState, observation: Float[Array, "n o"]) -> None:
        """Nothing: each update learns from its own steps."""

    def update(
        self, env: Env, config: FOPPOConfig, state: TrainState, progress: Float[Array, ""]
    ) -> tuple[TrainState, dict[str, Array]]:
        """A rollout and its exact gradient, PPO's epochs over it, then a step along the gradient.

        Args:
            env: the environment.
            config: numbers of the algorithm.
            state: where the last update ended.
            progress: share of the run that is done, in [0, 1]: sets the learning rate.

        Returns:
            The new state and the metrics of this update.
        """
        key, noise_key, epoch_key = jax.random.split(state.key, 3)
        learned, rate = state.parameters, annealed(config, progress)

        def gain(policy: Weights) -> tuple[dict[str, Array], Any]:
            return self._rollout(env, config, dataclasses.replace(learned, policy=policy), state, noise_key, progress)

        grads, (flight, samples, metrics), norms = ascended(gain, learned.policy, config.term_gradients)
        found, epochs_adam, losses = improve(
            self.actor, config, rate, learned, state.optimizer["epochs"], samples, epoch_key
        )
        policy, exact_adam, norm = descend(
            config, config.exact_rate * rate, found.policy, state.optimizer["exact"], grads
        )
        metrics |= norms | losses | {"loss/exact_gradient_norm": norm, "std": jnp.mean(jnp.exp(found.log_std))}
        return dataclasses.replace(
            state,
            parameters=dataclasses.replace(found, policy=policy),
            optimizer={"epochs": epochs_adam, "exact": exact_adam},
            env=flight.env,
            observation=flight.observation,
            memory=flight.memory,
            key=key,
        ), metrics

    def _rollout(
        self,
        env: Env,
        config: FOPPOConfig,
        parameters: Parameters,
        state: TrainState,
        key: PRNGKeyArray,
        progress: Float[Array, ""],
    ) -> tuple[dict[str, Array], Any]:
        """What the window gains, with gradient; and where it ends, the samples and the metrics, without."""
        noise = jax.random.normal(key, (config.horizon, *state.observation.shape[:1], 4))

        def worth(env_state: EnvState, observation: Array, memory: Array) -> Array:
            del memory
            return value(self.actor, parameters.critic, known(self.actor, env, env_state, observation))

        def step(flight: Flight, x: tuple[Array, Array]) -> tuple[Flight, Any]:
            z, cut = x
            flight, late = cut_off(config, flight, cut, worth)
            features = self.actor.features(flight.observation, flight.env.images)
            mean, memory = self.actor(parameters.policy, features, flight.memory)
            action = mean + jnp.exp(parameters.log_std) * z
            acted_on = (features, flight.memory, known(self.actor, env, flight.env, flight.observation), action)
            flight, gain, follows, out = flown(env, config, flight, action, memory, worth)
            gain["value"] += late
            gathered = (
                acted_on, (follows, out.reward), (out.terminated, out.done), out.success,
                {name: jnp.mean(x) for name, x in out.terms.items()},
            )  # fmt: skip
            return flight, (gain, jax.lax.stop_gradient(gathered))

        first = Flight.of(state.env, state.observation, state.memory)
        flight, (gain, gathered) = jax.lax.scan(step, first, (noise, ends(config, progress)))
        gain = {name: jnp.sum(x) / config.horizon for name, x in gain.items()}
        gain["value"] += flight.worth(worth) / config.horizon
        (features, memories, from_here, action), (follows, reward), ended, success, terms = gathered
        here = value(self.actor, parameters.critic, from_here)
        terminated, done = (x.astype(jnp.float32) for x in ended)
        advantage = gae(reward, here, follows, terminated, done, config.gamma, config.gae_lambda)
        density = -jnp.sum(0.5 * noise**2 + parameters.log_std + 0.5 * jnp.log(2 * jnp.pi), axis=-1)
        samples = Samples(features, memories, from_here, action, density, advantage, advantage + here)
        metrics = {
            "reward": jnp.mean(reward),
            **episode_metrics(done, success),
            **{f"reward/{name}": jnp.mean(x) for name, x in terms.items()},
        }
        return gain, jax.lax.stop_gradient((flight, samples, metrics))
