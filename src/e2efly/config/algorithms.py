"""Options of the learning algorithms."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar, Literal, TypeVar

from e2efly.config.numbers import check_fields, number, shape
from e2efly.config.registry import Registry


@dataclass(frozen=True)
class AlgorithmConfig:
    """Options of an algorithm, and everything that the commands need to know about it.

    An algorithm extends this and registers itself by `register`. Its numbers of type float are leaves of the compiled
    program; the others decide which program is compiled.
    """

    name: ClassVar[str] = ""
    """The name under which it is registered."""
    program: ClassVar[Any] = ""
    """The class of `e2efly.learning.algorithm.Algorithm` that learns, or its reference: `package.module:Name`."""
    like: ClassVar[str] = "ppo"
    """The algorithm whose rewards it uses for tasks that have none for it: ppo or bptt."""
    exact: ClassVar[bool] = False
    """Whether it differentiates the simulator. If so, it keeps the steps of the simulator for the gradient."""

    envs: int = number(64, above=0)
    """Number of environments that are simulated in parallel (sets shapes)."""
    horizon: int = number(64, above=0)
    """Steps of each environment between two updates: the length of a rollout or a window (sets shapes)."""
    max_grad_norm: float = number(0.5, above=0)
    """Largest norm of the gradient; larger gradients are clipped."""

    @property
    def steps(self) -> int:
        """Environment steps per update."""
        return self.envs * self.horizon

    def check(self) -> None:
        """Check the numbers, individually and in combination.

        Raises:
            ValueError: naming the field, the value and what is accepted.
        """
        check_fields("algo", self)

    def kept(self) -> dict[str, tuple[int, str]]:
        """What it keeps of earlier steps. For each option: how many, and whether they are `transition` or `state`."""
        return {}

    def fitted(self) -> tuple[int, str]:
        """Samples of gradient steps of an update, and the options that decide them, in words."""
        epochs = getattr(self, "epochs", 0)
        return epochs * self.steps, f", algo.epochs {epochs}" if epochs else ""


ALGORITHMS: Registry[type[AlgorithmConfig]] = Registry("algorithm")
"""The option classes of the algorithms, by name."""

C = TypeVar("C", bound=type[AlgorithmConfig])


def register(name: str) -> Callable[[C], C]:
    """Register the options of an algorithm under the name that commands and runs use.

    Raises:
        ValueError: for a name that is already used, or a class that is not an `AlgorithmConfig`.
    """
    return ALGORITHMS.extending(AlgorithmConfig, name)


def _check_minibatch(steps: int, minibatch: int) -> None:
    if steps % minibatch:
        raise ValueError(f"algo.minibatch is {minibatch}; accepted: a divisor of algo.envs * algo.horizon ({steps})")


@dataclass(frozen=True)
class _Annealed(AlgorithmConfig):
    """Options of every algorithm whose learning rate changes over a run."""

    learning_rate: float = number(4e-3, above=0, high=1.0)
    """Learning rate of Adam at the start."""
    learning_rate_end: float = number(1e-4, above=0, high=1.0)
    """Learning rate of Adam at the end."""
    decay: Literal["exponential", "linear"] = shape("exponential", added=True)
    """How the learning rate changes in between (sets the program)."""


@dataclass(frozen=True)
class _FirstOrder(_Annealed):
    """Options of every algorithm that differentiates the simulator."""

    exact: ClassVar = True

    gradient_decay: float = number(0.0, high=1e3)
    """Decay of the gradient from step to step through the vehicle's state, 1/s of backward time. The part that passes
    through the policy's observation of the state does not decay. 0: the exact gradient."""
    horizon_start: int = number(0)
    """Number of steps after which the gradient is cut at the start of a run. It grows over the run, up to the horizon.
    0: never cut."""
    term_gradients: bool = False
    """Whether to log the norm of the gradient of each reward term. Each update then has one backward pass per term."""

    def check(self) -> None:
        """See `AlgorithmConfig.check`."""
        super().check()
        if not 0 <= self.horizon_start <= self.horizon:
            raise ValueError(f"algo.horizon_start is {self.horizon_start}; accepted: 0 to {self.horizon}")


@dataclass(frozen=True)
class _Proximal(_Annealed):
    """Options of proximal policy optimisation and of algorithms that build on it."""

    epochs: int = number(2, above=0)
    """Passes over the samples of an update (sets shapes)."""
    minibatch: int = number(512, above=0)
    """Samples per gradient step; must divide envs * horizon (sets shapes)."""
    sequence: int = number(16, above=0)
    """Number of steps over which the gradient of a GRU is propagated back; must divide horizon and minibatch (sets
    shapes)."""
    learning_rate: float = number(3e-3, above=0, high=1.0)
    """Learning rate of Adam at the start."""
    learning_rate_end: float = number(3e-4, above=0, high=1.0)
    """Learning rate of Adam at the end."""
    gae_lambda: float = number(0.95, high=1)
    """Lambda of the generalised advantage estimate."""
    clip: float = number(0.2, high=10.0)
    """Clipping range of the probability ratio."""
    value_weight: float = number(0.5, high=1e3)
    """Weight of the critic's loss."""
    entropy_weight: float = number(0.0, high=1e3)
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

    program: ClassVar = "e2efly.learning.ppo:PPO"

    gamma: float = number(0.96, above=0, high=1)
    """Discount per step."""


IMITATION_WINDOW = 32
"""Steps of a window of imitation, over which the gradient of a GRU is propagated back."""


@register("bptt")
@dataclass(frozen=True)
class BPTTConfig(_FirstOrder):
    """Back-propagation through time: the exact gradient of the return through physics and policy."""

    program: ClassVar = "e2efly.learning.bptt:BPTT"

    gamma: float = number(0.99, above=0, high=1)
    """Discount per step within the window."""
    average: float | None = number(None, high=0.9999)
    """Largest weight of the old value in a running mean of the policy, per update. While there are few policies, their
    plain mean is used. The running mean is evaluated and exported. None: no mean (sets the program)."""
    imitated: float | None = number(None, above=0, high=0.99, added=True)
    """Share of the run, at its start, in which the policy imitates the task's expert (as `dagger` does) in place of
    following the gradient of the reward. None: no part of it (sets the program)."""
    imitation_rate: float = number(2e-3, above=0, high=1.0, added=True)
    """Learning rate of Adam at the start of the imitation. At its end it is `learning_rate`."""
    league: int = number(0, high=64, added=True, sets_shapes=True)
    """Number of past selves that are kept as opponents, for tasks with several vehicles in a world: in every second
    world, one of them flies all vehicles but the first (sets shapes)."""

    def check(self) -> None:
        """See `AlgorithmConfig.check`."""
        super().check()
        if self.imitated is not None and self.horizon % IMITATION_WINDOW:
            raise ValueError(
                f"algo.horizon is {self.horizon}; accepted with algo.imitated: a multiple of {IMITATION_WINDOW}, the "
                "steps of a window of imitation"
            )


@register("shac")
@dataclass(frozen=True)
class SHACConfig(_FirstOrder):
    """Short-horizon actor-critic (Xu et al. 2022): the exact gradient over a window, and a critic's value beyond it."""

    program: ClassVar = "e2efly.learning.shac:SHAC"

    horizon: int = number(32, above=0)
    """Steps of a window (sets shapes)."""
    epochs: int = number(4, above=0)
    """Passes of the critic over the samples of a window (sets shapes)."""
    minibatch: int = number(512, above=0)
    """Samples per gradient step of the critic; must divide envs * horizon (sets shapes)."""
    critic_rate: float = number(0.5, high=1e3)
    """The critic's learning rate relative to the policy's."""
    gamma: float = number(0.98, above=0, high=1)
    """Discount per step."""
    td_lambda: float = number(0.95, high=1)
    """Lambda of the returns that the critic learns to predict."""
    target_share: float = number(0.2, high=1)
    """Fraction by which the slow copy of the critic moves towards the critic, per update."""
    noise: float = number(0.0, high=10.0)
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

    program: ClassVar = "e2efly.learning.abpt:ABPT"

    horizon: int = number(32, above=0)
    """Steps of a window (sets shapes)."""
    collect: int = number(8, above=0)
    """Steps of each environment that are added to the replay buffer per update (sets shapes)."""
    buffer: int = 65_536
    """Transitions in the replay buffer, a multiple of envs * collect (sets shapes)."""
    places: int = 1024
    """Number of visited states from which windows may begin; a multiple of envs (sets shapes)."""
    minibatch: int = number(1024, above=0)
    """Samples per gradient step of the critics (sets shapes)."""
    fits: int = number(8, above=0)
    """Gradient steps of the critics per update (sets shapes)."""
    critic_rate: float = number(0.5, high=1e3)
    """The critics' learning rate relative to the policy's."""
    gamma: float = number(0.98, above=0, high=1)
    """Discount per step."""
    target_share: float = number(0.02, high=1)
    """Fraction by which the slow copies of the critics move towards the critics, per gradient step."""
    fresh_share: float = number(0.5, high=1)
    """Share of the windows that begin at a new start; the others begin at visited states."""
    at_once: float = number(0.5, high=1)
    """Weight of the critics' value of the first action of a window. The window's own return has the remaining
    weight."""
    entropy_weight: float = number(1e-3, high=1e3)
    """Weight of the entropy bonus."""
    log_std: float = number(-2.0, low=-10, high=2)
    """Initial log standard deviation of the action noise."""

    @property
    def steps(self) -> int:
        """Environment steps per update."""
        return self.envs * (self.collect + self.horizon)

    def check(self) -> None:
        """See `AlgorithmConfig.check`."""
        super().check()
        for name, value, of in (("buffer", self.buffer, self.envs * self.collect), ("places", self.places, self.envs)):
            if value < 1 or value % of:
                raise ValueError(f"algo.{name} is {value}; accepted: a positive multiple of {of}, what an update adds")

    def kept(self) -> dict[str, tuple[int, str]]:
        """The replay buffer, and the states from which windows may begin."""
        return {"buffer": (self.buffer, "transition"), "places": (self.places, "state")}

    def fitted(self) -> tuple[int, str]:
        """See `AlgorithmConfig.fitted`."""
        return self.fits * self.minibatch, f", algo.fits {self.fits}, algo.minibatch {self.minibatch}"


@register("foppo")
@dataclass(frozen=True)
class FOPPOConfig(_Proximal, _FirstOrder):
    """PPO refined by first-order gradients: epochs over a rollout, then a step along its exact gradient. Our method."""

    program: ClassVar = "e2efly.learning.foppo:FOPPO"

    horizon: int = number(32, above=0)
    """Steps of a rollout. The rollout is also the window of the exact gradient (sets shapes)."""
    log_std: float = number(-1.5, low=-10, high=2)
    """Initial log standard deviation of the action noise."""
    exact_rate: float = number(3.0, high=1e3)
    """Learning rate of the step along the exact gradient, relative to that of the epochs."""
    gamma: float = number(0.98, above=0, high=1)
    """Discount per step."""


EXPERT = "expert"
"""The name of a task's expert as a teacher."""


@register("dagger")
@dataclass(frozen=True)
class DAggerConfig(_Annealed):
    """Imitation of a policy that is told more, on the states that the learner meets (Ross et al. 2011)."""

    program: ClassVar = "e2efly.learning.dagger:DAgger"
    like: ClassVar = "bptt"

    horizon: int = number(IMITATION_WINDOW, above=0)
    """Steps of a window, over which the gradient of a GRU is propagated back (sets shapes)."""
    teacher: str = ""
    """The policy that is imitated: a task of the zoo, a run, or a policy.onnx, without cameras. expert: the expert of
    the task, if it has one. If it is empty, the zoo's policy of the task (sets the program)."""
    led: float = number(0.15, high=1.0)
    """Share of the run in which the teacher flies, too: in all windows at its start, in none from then on."""
    learning_rate: float = number(2e-3, above=0, high=1.0)
    """Learning rate of Adam at the start."""
