"""Flights of a policy as NumPy arrays, for the plots."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int, PRNGKeyArray

from e2efly.control import Quat
from e2efly.environment import Env
from e2efly.environment.episodes import Act, trace


@dataclass(frozen=True)
class Flights:
    """`n` episodes over `t` control steps. Row k is the state after step k. Rows from `length` on are after the end."""

    time: Float[np.ndarray, " t"]
    """Time since the start of the episode at the end of each step, s. The first time is one control period."""
    position: Float[np.ndarray, "t n 3"]
    """Centre of mass, world, m."""
    velocity: Float[np.ndarray, "t n 3"]
    """World, m/s."""
    quaternion: Float[np.ndarray, "t n 4"]
    """Unit quaternion wxyz, body to world."""
    body_rate: Float[np.ndarray, "t n 3"]
    """Body, rad/s."""
    rotor_speed: Float[np.ndarray, "t n r"]
    """In the order of the vehicle file, of a quadrotor rear right, front right, rear left, front left; rad/s."""
    command: Float[np.ndarray, "t n c"]
    """Command of the policy at the start of the step, in the units of the command mode. It acts one latency later."""
    goal: Float[np.ndarray, "t n 3"]
    """Goal position at `time`, world, m."""
    length: Int[np.ndarray, " n"]
    """Number of steps until the episode ended."""
    success: Bool[np.ndarray, " n"]
    """Whether the episode succeeded."""
    command_mode: str = "ctbr"
    """The command mode of `command`, a name of `e2efly.control.COMMAND_MODES`."""
    late: Bool[np.ndarray, " n"] | None = None
    """Whether the episode timed out. None: not known."""
    agents: int = 1
    """Number of vehicles in a world. Those of a world are next to each other."""
    images: tuple[np.ndarray, ...] = ()
    """The images that the policy saw at the start of each step, by camera: (t, n, h, w) or (t, n, h, w, 3)."""

    def ending(self, index: int) -> str:
        """How an episode ended, in a word or two."""
        if self.success[index]:
            return "success"
        if self.late is None:
            return "no success"
        return "out of time" if self.late[index] else "crashed or left"

    @property
    def speed(self) -> Float[np.ndarray, "t n"]:
        """Speed, m/s."""
        return np.linalg.norm(self.velocity, axis=-1)

    @property
    def tilt(self) -> Float[np.ndarray, "t n"]:
        """Angle between the body's z axis and up, rad."""
        x, y = self.quaternion[..., 1], self.quaternion[..., 2]
        return 2 * np.arcsin(np.clip(np.hypot(x, y), 0.0, 1.0))

    @property
    def yaw(self) -> Float[np.ndarray, "t n"]:
        """Heading of the body's x axis, rad in [-pi, pi]."""
        return Quat.of(self.quaternion).yaw()


def fly(env: Env, act: Act, key: PRNGKeyArray, n: int, steps: int) -> Flights:
    """Fly `n` episodes of at most `steps` control steps.

    Args:
        env: the environment.
        act: the policy.
        key: random key that decides the starts and all noise.
        n: number of episodes, which are simulated together. There are a few more for whole worlds of several vehicles.
        steps: largest number of control steps. Longer episodes are cut off.
    """
    shown, n = list[tuple[np.ndarray, ...]](), env.whole(n)

    def watched(observation: Any, images: tuple[Any, ...], memory: Any) -> tuple[Any, Any]:
        shown.append(images)
        return act.act(observation, images, memory)

    reached, command, goal, out = trace(env, replace(act, act=watched), key, n, steps)
    parts = (reached.position, reached.velocity, reached.quaternion, reached.body_rate, reached.rotor_speed)
    arrays = (np.asarray(x) for x in (*parts, command, goal))
    done, success = np.asarray(out.done), np.asarray(out.success)
    length = np.where(done.any(axis=0), done.argmax(axis=0) + 1, steps)
    return Flights(
        env.control_period * np.arange(1, steps + 1),
        *arrays,
        length=length,
        success=success[length - 1, np.arange(n)],
        command_mode=env.physics.command_mode,
        images=tuple(np.stack(of) for of in zip(*shown, strict=True)),
        agents=env.agents,
        late=~np.asarray(out.terminated)[length - 1, np.arange(n)],
    )
