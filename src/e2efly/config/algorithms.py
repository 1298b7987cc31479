"""Options of the learning algorithms."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar, TypeVar

from e2efly.numbers import check_numbers, number
from e2efly.registry import Registry


@dataclass(frozen=True)
class AlgorithmConfig:
    """Options of an algorithm, and all that commands ask of an algorithm.

    An algorithm extends this and registers itself by `register`. Its numbers of type float are leaves of the compiled
    program; the others decide which program is compiled.
    """

    name: ClassVar[str] = ""
    """By which it is registered."""
    program: ClassVar[Any] = ""
    """The class of `e2efly.learn.algorithm.Algorithm` that learns, or its reference: `package.module:Name`."""
    like: ClassVar[str] = "ppo"
    """Whose recipe of a task it takes its rewards from, where it has none of its own: ppo or bptt."""
    exact: ClassVar[bool] = False
    """Whether it differentiates the simulator, whose steps it then keeps."""

    envs: int = number(64, above=0)
    """Environments side by side (sets shapes)."""
    horizon: int = number(64, above=0)
    """Steps of each environment between updates: a rollout, a window (sets shapes)."""
    max_grad_norm: float = number(0.5, above=0)
    """Norm to which a gradient is clipped."""

    @property
    def steps(self) -> int:
        """Environment steps of an update."""
        return self.envs * self.horizon

    def check(self) -> None:
        """Check the numbers, each by itself and together.

        Raises:
            ValueError: naming the field, the value and what is accepted.
        """
        check_numbers("algo", self)

    def kept(self) -> dict[str, tuple[int, str]]:
        """What it keeps of earlier steps: by option how many, and whether each is a `transition` or a `state`."""
        return {}

    def fitted(self) -> tuple[int, str]:
        """Samples of gradient steps of an update, and the options that decide them, in words."""
        epochs = getattr(self, "epochs", 0)
        return epochs * self.steps, f", algo.epochs {epochs}" if epochs else ""


ALGORITHMS: Registry[type[AlgorithmConfig]] = Registry("algorithm")
"""The options of the algorithms, by name."""

C = TypeVar("C", bound=type[AlgorithmConfig])


def register(name: str) -> Callable[[C], C]:
    """Register the options of an algorithm under a name, by which commands and runs know it.

    Raises:
        ValueError: for a name that is taken, or a class that is no `AlgorithmConfig`.
    """

    def registered(options: C) -> C:
        if not (isinstance(options, type) and issubclass(options, AlgorithmConfig)):
            raise ValueError(f"algorithm {name!r} is {options!r}; accepted: a dataclass that extends AlgorithmConfig")
        options.name = name
        ALGORITHMS.add(name, options)
        return options

    return registered


def _check_minibatch(steps: int, minibatch: int) -> None:
    if steps % minibatch:
        raise ValueError(f"algo.minibatch is {minibatch}; accepted: a divisor of algo.envs * algo.horizon ({steps})")


@dataclass(frozen=True)
class _FirstOrder(AlgorithmConfig):
    """What every algorithm has that differentiates the simulator."""

    exact: ClassVar = True

    gradient_decay: float = 0.0
    """Decay of the gradient from step to step through the vehicle's state, 1/s of backward time; what goes through the
    policy's observation of it does not decay. 0: the exact gradient."""
    horizon_start: int = number(0, low=-math.inf)
    """Steps, of the horizon, after which the gradient is cut at first; they grow over the run. 0: never cut."""
    term_gradients: bool = False
    """Whether to log the norm of the gradient of each term of the reward; an update takes as many times as long."""

    def check(self) -> None:
        """See `AlgorithmConfig.check`."""
        super().check()
        if not 0 <= self.horizon_start <= self.horizon:
            raise ValueError(f"algo.horizon_start is {self.horizon_start}; accepted: 0 to {self.horizon}")


@dataclass(frozen=True)
class _Proximal(AlgorithmConfig):
    """What proximal policy optimisation and what builds on it have."""

    epochs: int = number(2, above=0)
    """Passes over the samples of an update (sets shapes)."""
    minibatch: int = number(512, above=0)
    """Samples of a gradient step; divides envs * horizon (sets shapes)."""
    sequence: int = number(16, above=0)
    """Steps through which the gradient of a GRU goes back; divides horizon and minibatch (sets shapes)."""
    learning_rate: float = number(3e-3, above=0)
    """Adam's step at the start."""
    learning_rate_end: float = number(3e-4, above=0)
    """Adam's step at the end; exponential in between."""
    gae_lambda: float = number(0.95, high=1)
    """Lambda of the generalised advantage estimate."""
    clip: float = 0.2
    """Clip of the probability ratio."""
    value_weight: float = 0.5
    """Weight of the critic's loss."""
    entropy_weight: float = 0.0
    """Weight of the entropy bonus."""
    log_std: float = number(-1.0, low=-10, high=2)
    """Initial log standard deviation of the action noise."""

    def check(self) -> None:
        """See `AlgorithmConfig.check`."""
        super().check()
        _check_minibatch(self.steps, self.minibatch)


@register("ppo")
@dataclass(frozen=True)
class PPOConfig(_Proximal):
    """Proximal policy optimisation (Schulman et al. 2017)."""

    program: ClassVar = "e2efly.learn.ppo:PPO"

    gamma: float = number(0.96, above=0, high=1)
    """Discount per step."""


@register("bptt")
@dataclass(frozen=True)
class BPTTConfig(_FirstOrder):
    """Back-propagation through time: the exact gradient of the return through physics and policy."""

    program: ClassVar = "e2efly.learn.bptt:BPTT"

    learning_rate: float = number(4e-3, above=0)
    """Adam's step at the start."""
    learning_rate_end: float = number(1e-4, above=0)
    """Adam's step at the end; exponential in between."""
    gamma: float = number(0.99, above=0, high=1)
    """Discount per step within the window."""
    average: float | None = number(None, high=0.9999)
    """Share of the old in a running mean of the policy, an update, at most; as long as there are few, their plain mean.
    The mean is judged and shipped. None: the policy itself (sets the program)."""


@register("shac")
@dataclass(frozen=True)
class SHACConfig(_FirstOrder):
    """Short-horizon actor-critic (Xu et al. 2022): the exact gradient over a window, and a critic's beyond it."""

    program: ClassVar = "e2efly.learn.shac:SHAC"

    horizon: int = number(32, above=0)
    """Steps of a window (sets shapes)."""
    epochs: int = number(4, above=0)
    """Passes of the critic over the samples of a window (sets shapes)."""
    minibatch: int = number(512, above=0)
    """Samples of a gradient step of the critic; divides envs * horizon (sets shapes)."""
    learning_rate: float = number(4e-3, above=0)
    """Adam's step at the start."""
    learning_rate_end: float = number(1e-4, above=0)
    """Adam's step at the end; exponential in between."""
    critic_rate: float = 0.5
    """The critic's step over the policy's."""
    gamma: float = number(0.98, above=0, high=1)
    """Discount per step."""
    td_lambda: float = number(0.95, high=1)
    """Lambda of the returns that the critic learns."""
    target_share: float = number(0.2, high=1)
    """How far the critic's slow copy follows it, an update."""
    noise: float = 0.0
    """Standard deviation of the noise on the action."""

    def check(self) -> None:
        """See `AlgorithmConfig.check`."""
        super().check()
        _check_minibatch(self.steps, self.minibatch)


@register("abpt")
@dataclass(frozen=True)
class ABPTConfig(_FirstOrder):
    """Amended back-propagation through time (Li et al. 2025): windows of exact gradients between values of critics that
    learn from a replay buffer.
    """

    program: ClassVar = "e2efly.learn.abpt:ABPT"

    horizon: int = number(32, above=0)
    """Steps of a window (sets shapes)."""
    collect: int = number(8, above=0)
    """Steps of each environment into the replay buffer, an update (sets shapes)."""
    buffer: int = 65_536
    """Transitions in the replay buffer, a multiple of envs * collect (sets shapes)."""
    places: int = 1024
    """Visited states that windows may begin at, a multiple of envs (sets shapes)."""
    minibatch: int = number(1024, above=0)
    """Samples of a gradient step of the critics (sets shapes)."""
    fits: int = number(8, above=0)
    """Gradient steps of the critics, an update (sets shapes)."""
    learning_rate: float = number(4e-3, above=0)
    """Adam's step at the start."""
    learning_rate_end: float = number(1e-4, above=0)
    """Adam's step at the end; exponential in between."""
    critic_rate: float = 0.5
    """The critics' step over the policy's."""
    gamma: float = number(0.98, above=0, high=1)
    """Discount per step."""
    target_share: float = number(0.02, high=1)
    """How far the critics' slow copies follow them, a gradient step."""
    fresh_share: float = number(0.5, high=1)
    """Share of the windows that begin at a new start; the others begin at visited states."""
    at_once: float = number(0.5, high=1)
    """Weight of the critics' value of a window's first action; the window's own return has the rest."""
    entropy_weight: float = 1e-3
    """Weight of the entropy bonus."""
    log_std: float = number(-2.0, low=-10, high=2)
    """Initial log standard deviation of the action noise."""

    @property
    def steps(self) -> int:
        """Environment steps of an update."""
        return self.envs * (self.collect + self.horizon)

    def check(self) -> None:
        """See `AlgorithmConfig.check`."""
        super().check()
        for name, value, of in (("buffer", self.buffer, self.envs * self.collect), ("places", self.places, self.envs)):
            if value < 1 or value % of:
                raise ValueError(f"algo.{name} is {value}; accepted: a positive multiple of {of}, what an update adds")

    def kept(self) -> dict[str, tuple[int, str]]:
        """The replay buffer, and the places that windows may begin at."""
        return {"buffer": (self.buffer, "transition"), "places": (self.places, "state")}

    def fitted(self) -> tuple[int, str]:
        """See `AlgorithmConfig.fitted`."""
        return self.fits * self.minibatch, f", algo.fits {self.fits}, algo.minibatch {self.minibatch}"


@register("foppo")
@dataclass(frozen=True)
class FOPPOConfig(_Proximal, _FirstOrder):
    """PPO refined by first-order gradients: epochs over a rollout, then a step along its exact gradient. Ours."""

    program: ClassVar = "e2efly.learn.foppo:FOPPO"

    horizon: int = number(32, above=0)
    """Steps of a rollout, which is the window of the exact gradient (sets shapes)."""
    log_std: float = number(-1.5, low=-10, high=2)
    """Initial log standard deviation of the action noise."""
    exact_rate: float = 3.0
    """The step along the exact gradient over that of the epochs."""
    gamma: float = number(0.98, above=0, high=1)
    """Discount per step."""
