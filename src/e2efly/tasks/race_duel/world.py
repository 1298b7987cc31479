"""Racing against others: the starts of whole worlds, and the racers among each other."""

import dataclasses
from dataclasses import dataclass
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, PRNGKeyArray

from e2efly.policy.goal import Outcome, Shape
from e2efly.policy.others import Others, nobody
from e2efly.simulation.physics import State
from e2efly.simulation.physics.rotation import from_euler
from e2efly.simulation.scenes.scene import Scene
from e2efly.tasks import company
from e2efly.tasks.race.world import Race
from e2efly.tasks.race_duel import RaceDuelConfig
from e2efly.tasks.race_duel.goal import RaceDuelGoal, RaceDuelMemory

BEFORE = 1.5
"""Distance in front of a gate at which a racer starts that does not start at the track's start, m."""
CLEAR = 1.0
"""Distance of the first place of start from the first gate, m."""


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class RaceDuelWorld(RaceDuelMemory):
    """All others as they are, and how the race stands."""

    bodies: Others
    """All others, at `time`."""
    time: Float[Array, " n"]
    """Time at the end of the last step, s."""
    finished: Bool[Array, " n"]
    """Whether the racer has finished. What happens to it afterwards does not count."""
    touched: Bool[Array, " n"]
    """Whether the racer touched another before it had finished."""
    out: Bool[Array, " n"]
    """Whether the racer missed or touched a gate, or left the track, before it had finished."""
    blind: Bool[Array, " n"]
    """Whether the racer is shown nobody."""


@partial(
    jax.tree_util.register_dataclass,
    data_fields=["config", "shape", "track"],
    meta_fields=["closed", "control_period", "checks"],
)
@dataclass(frozen=True)
class RaceDuel(RaceDuelGoal):
    """Make it with `RaceDuel.of`."""

    @classmethod
    def of(cls, config: RaceDuelConfig, shape: Shape, control_period: float, checks: int = 1) -> "RaceDuel":
        """Load the track.

        Raises:
            ValueError: for an unknown or broken track, and for one whose first gate is too near for the places.
        """
        race = Race.of(config, shape, control_period, checks)
        assert isinstance(race, Race)  # the options hold no track of random worlds: `RaceDuelConfig.check`
        first = float(np.linalg.norm(race.gates.position[0] - race.gates.start))
        if (config.agents - 1) * config.spacing + config.position > first - CLEAR:
            raise ValueError(
                f"task.spacing is {config.spacing}; accepted: at most "
                f"{(first - CLEAR - config.position) / (config.agents - 1):.2f} m, so that the places of "
                f"{config.agents} racers are in front of the first gate, {first:.2f} m from the start"
            )
        numbers = dataclasses.replace(config, track="")  # resolved here: tracks share a compiled program
        return cls(numbers, shape, race.gates, race.closed, control_period, checks)

    @property
    def race(self) -> Race:
        """The same race without the others."""
        return Race(self.config, self.shape, self.track, self.closed)

    @property
    def agents(self) -> int:
        """Number of racers in a world."""
        return self.config.agents

    def start(self, key: PRNGKeyArray, n: int) -> tuple[State, RaceDuelWorld]:
        """At rest behind each other, in random order, each in a ball around its place. In the worlds that are
        scattered, in front of different gates.
        """
        a, c, g = self.agents, self.config, self.track
        grid_key, key, scatter_key, blind_key = jax.random.split(key, 4)
        state, passed = self.race.start(key, n)
        keys = jax.random.split(grid_key, n // a)
        order = jax.vmap(lambda k: jax.random.permutation(k, a))(keys).reshape(n)
        ahead, left = c.spacing * order, c.spacing * (0.5 - order % 2)
        yaw = jnp.asarray(self.race.gates.start_yaw)
        cos, sin = jnp.cos(yaw), jnp.sin(yaw)
        moved = jnp.stack([ahead * cos - left * sin, ahead * sin + left * cos, jnp.zeros(n)], axis=-1)
        keys = jax.random.split(scatter_key, n // a)
        chance = jax.vmap(lambda k: jax.random.uniform(k, (g.count + 1,)))(keys)
        gate = jnp.argsort(chance[:, 1:], axis=1)[:, jnp.arange(a) % g.count].reshape(n)
        anywhere = jnp.repeat(chance[:, 0] < c.scattered, a)
        axis = jnp.stack([jnp.asarray(g.cos)[gate], jnp.asarray(g.sin)[gate], jnp.zeros(n)], axis=-1)
        there = jnp.asarray(g.position)[gate] - BEFORE * axis - jnp.asarray(g.start)
        turned = jnp.where(anywhere, jnp.arctan2(axis[:, 1], axis[:, 0]), yaw)
        zero, passed = jnp.zeros(n), jnp.where(anywhere, gate, passed)
        position = state.position + jnp.where(anywhere[:, None], there, moved)
        state = dataclasses.replace(state, position=position, quaternion=from_euler(zero, zero, turned))
        others, bodies = company.nearest(state, a, c.neighbours), company.all_others(state, a)
        no = jnp.zeros(n, bool)
        blind = jax.random.uniform(blind_key, (n,)) < c.blind
        return state, RaceDuelWorld(passed, others, bodies, jnp.zeros(n), no, no, no, blind)

    def observe(self, memory: RaceDuelWorld, time: Float[Array, " n"], state: State) -> Float[Array, "n o"]:
        """The others are seen with the age and the errors with which the vehicle sees itself."""
        near, away = company.nearest(state, self.agents, self.config.neighbours), memory.blind[:, None, None]
        none = nobody(state.position, self.config.neighbours)
        others = Others(jnp.where(away, none.position, near.position), jnp.where(away, none.velocity, near.velocity))
        return super().observe(self.among(memory, others), time, state)

    def scene(self, memory: RaceDuelWorld) -> Scene:
        """The gates and the others over level ground."""
        gates = self.race.scene(memory.passed)
        others = company.spheres(memory.bodies, memory.time, self.shape.radius)
        return dataclasses.replace(gates, solids={**gates.solids, "sphere": others})

    def desired_yaw(self, memory: RaceDuelWorld, state: State) -> Float[Array, " n"]:
        """Towards the next gate."""
        return self.race.desired_yaw(memory.passed, state)

    def advance(
        self, memory: Any, before: State, after: State, time: Float[Array, " n"], timed_out: Bool[Array, " n"]
    ) -> tuple[RaceDuelWorld, Outcome]:
        """The world's verdict: it succeeds when all have finished, and nobody had touched anything until then.

        It ends then, or when a racer has left the track.
        """
        a, reach = self.agents, 2 * self.shape.radius
        passed, one = self.race.advance(memory.passed, before, after, time, timed_out)
        racing, finished = ~memory.finished, memory.finished | one.success
        hit = company.collided(before, after, self.control_period, self.checks, a, reach) & racing
        left = one.crashed & racing
        touched, out = memory.touched | hit, memory.out | left
        done, clean = company.all_of_world(finished, a), ~company.any_of_world(touched | out, a)
        ends = company.any_of_world(left | (hit & (self.config.collisions_end > 0)), a) | done
        bodies = company.all_others(jax.lax.stop_gradient(after), a)
        moved = RaceDuelWorld(passed, memory.others, bodies, time, finished, touched, out, memory.blind)
        signals = one.signals | {"misses": company.misses(after, a, reach)}
        return moved, dataclasses.replace(
            one, terminated=ends, success=done & clean, crashed=left | hit, signals=signals
        )
