"""Exchanging places: the starts of whole worlds, and the vehicles among each other."""

import dataclasses
from dataclasses import dataclass
from functools import partial

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, PRNGKeyArray

from e2efly.policy.goal import Outcome
from e2efly.policy.others import Others
from e2efly.simulation.physics import State
from e2efly.simulation.physics.rotation import from_euler
from e2efly.simulation.scenes.scene import Scene
from e2efly.tasks import company
from e2efly.tasks.swap.goal import SwapGoal, SwapMemory
from e2efly.tasks.swap.pilot import PACE, nearest_of, way
from e2efly.tasks.task import Flier, at_rest, uniform


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class SwapWorld(SwapMemory):
    """All others as they are, for cameras and the reward."""

    bodies: Others
    """All others, at `time`."""
    time: Float[Array, " n"]
    """Time at the end of the last step, s."""
    stayed: Bool[Array, " n"]
    """Whether no vehicle of the world has touched another."""


@partial(jax.tree_util.register_dataclass, data_fields=["config", "shape"], meta_fields=["control_period", "checks"])
@dataclass(frozen=True)
class Swap(SwapGoal):
    """Vehicles at random places, each of which is to go to the place of another."""

    @property
    def agents(self) -> int:
        """Number of vehicles in a world."""
        return self.config.agents

    def start(self, key: PRNGKeyArray, n: int) -> tuple[State, SwapWorld]:
        """At rest, in any direction, each in a random cell of the square; the places are exchanged at random, and none
        keeps its own.
        """
        c, a, worlds = self.config, self.agents, n // self.agents
        cell_key, turn_key, key = jax.random.split(key, 3)
        cells = jax.vmap(lambda k: jax.random.permutation(k, c.cells**2)[:a])(jax.random.split(cell_key, worlds))
        size, u = c.side / c.cells, uniform(key, n, 4)
        corner = jnp.stack([cells.reshape(-1) % c.cells, cells.reshape(-1) // c.cells], axis=-1)
        level = (corner + 0.5) * size - c.side / 2 + (size - c.apart) / 2 * u[:, :2]
        position = jnp.asarray(c.centre) + jnp.concatenate([level, c.height * u[:, 2:3]], axis=-1)
        turn = jax.random.randint(turn_key, (worlds, 1), 1, a)  # the cells are in random order: any shift exchanges
        chosen = (jnp.arange(a) + turn) % a
        place = jnp.take_along_axis(position.reshape(worlds, a, 3), chosen[..., None], axis=1).reshape(n, 3)
        zero = jnp.zeros(n)
        state = dataclasses.replace(at_rest(position), quaternion=from_euler(zero, zero, jnp.pi * u[:, 3]))
        others, bodies = company.nearest(state, a, c.neighbours), company.all_others(state, a)
        return state, SwapWorld(place, zero, others, bodies, zero, jnp.ones(n, bool))

    def observe(self, memory: SwapWorld, time: Float[Array, " n"], state: State) -> Float[Array, "n o"]:
        """The others are seen with the age and the errors with which the vehicle sees itself."""
        others = company.nearest(state, self.agents, self.config.neighbours)
        return super().observe(self.among(memory, others), time, state)

    def scene(self, memory: SwapWorld) -> Scene:
        """The others over level ground."""
        balls = company.spheres(memory.bodies, memory.time, self.shape.radius)
        return Scene.of({"sphere": balls}, memory.place.shape[0])

    def expert(self, memory: SwapWorld, flier: Flier) -> tuple[Float[Array, "n 3"], Float[Array, " n"]]:
        """Velocity, m/s, and yaw, rad, of an expert that knows as many of the nearest others as the policy."""
        c, bodies, later = self.config, memory.bodies, (flier.time - memory.time)[:, None, None]
        bodies = dataclasses.replace(bodies, position=bodies.position + later * bodies.velocity)
        known = nearest_of(bodies, flier.position, min(c.neighbours, c.agents - 1))
        return way(known, flier, memory.place, PACE * c.speed), flier.yaw

    def desired_yaw(self, memory: SwapWorld, state: State) -> Float[Array, " n"]:
        """Along world x."""
        return jnp.zeros_like(memory.held)

    def advance(
        self, memory: SwapWorld, before: State, after: State, time: Float[Array, " n"], timed_out: Bool[Array, " n"]
    ) -> tuple[SwapWorld, Outcome]:
        """The world's verdict: it ends, and it succeeds, for all of its vehicles together."""
        a = self.agents
        hit = company.collided(before, after, self.control_period, self.checks, a, 2 * self.shape.radius)
        moved, one = self.verdict(memory, after, timed_out, hit)
        stayed = memory.stayed & ~company.any_of_world(hit, a)
        bodies = company.all_others(jax.lax.stop_gradient(after), a)
        moved = dataclasses.replace(moved, bodies=bodies, time=time, stayed=stayed)
        ends, well = company.any_of_world(one.terminated, a), company.all_of_world(one.success, a) & stayed
        misses = company.misses(after, a, 2 * self.shape.radius)
        signals = {"desired_speed": jnp.broadcast_to(self.config.speed, time.shape), "misses": misses}
        return moved, dataclasses.replace(one, terminated=ends, success=well, signals=signals)
