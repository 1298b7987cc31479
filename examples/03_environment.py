"""Step the environment by hand: 256 hovering tasks with random mass, motors, wind and latency."""

import jax
import jax.numpy as jnp

from e2efly.config import EnvConfig, RewardConfig
from e2efly.environment import Env, random_key
from e2efly.tasks.hover import HoverConfig

env = Env.of(
    HoverConfig(),
    RewardConfig({"prog2": 1.0, "anglev": 0.01}),
    EnvConfig(randomize={"mass": 0.1, "motor_time_constant": 0.2}, wind=1.0, action_latency=(0.03, 0.09)),
)
state, observation = jax.jit(env.reset, static_argnums=1)(random_key(0), 256)
step = jax.jit(env.step)
for field in env.fields:
    print(f"{field.name:16s} {field.size:3d}  {field.frame:11s} {field.unit}")
for _ in range(30):
    state, out = step(state, jnp.broadcast_to(env.hover, (256, 4)))
print(f"after 1 s of the hover action: mean reward {out.reward.mean():.2f}, crashed {int(out.terminated.sum())}")
print({name: f"{value.mean():.3f}" for name, value in out.terms.items()})
