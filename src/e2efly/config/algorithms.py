"""Options of the learning algorithms."""

from dataclasses import dataclass


@dataclass(frozen=True)
class _Batch:
    """What every algorithm has."""

    envs: int = 64
    """Environments side by side (sets shapes)."""
    horizon: int = 64
    """Steps of each environment between updates: a rollout, a window (sets shapes)."""
    max_grad_norm: float = 0.5
    """Norm to which a gradient is clipped."""

    @property
    def steps(self) -> int:
        """Environment steps of an update."""
        return self.envs * self.horizon


@dataclass(frozen=True)
class _FirstOrder(_Batch):
    """What every algorithm has that differentiates the simulator."""

    gradient_decay: float = 0.0
    """Decay of the gradient from step to step through the vehicle's state, 1/s of backward time; what goes through the
    policy's observation of it does not decay. 0: the exact gradient."""
    horizon_start: int = 0
    """Steps, of the horizon, after which the gradient is cut at first; they grow over the run. 0: never cut."""
    term_gradients: bool = False
    """Whether to log the norm of the gradient of each term of the reward; an update takes as many times as long."""


@dataclass(frozen=True)
class _Proximal(_Batch):
    """What proximal policy optimisation and what builds on it have."""

    epochs: int = 2
    """Passes over the samples of an update (sets shapes)."""
    minibatch: int = 512
    """Samples of a gradient step; divides envs * horizon (sets shapes)."""
    learning_rate: float = 3e-3
    """Adam's step at the start."""
    learning_rate_end: float = 3e-4
    """Adam's step at the end; exponential in between."""
    gae_lambda: float = 0.95
    """Lambda of the generalised advantage estimate."""
    clip: float = 0.2
    """Clip of the probability ratio."""
    value_weight: float = 0.5
    """Weight of the critic's loss."""
    entropy_weight: float = 0.0
    """Weight of the entropy bonus."""
    log_std: float = -1.0
    """Initial log standard deviation of the action noise."""


@dataclass(frozen=True)
class PPOConfig(_Proximal):
    """Proximal policy optimisation (Schulman et al. 2017)."""

    gamma: float = 0.96
    """Discount a step."""


@dataclass(frozen=True)
class BPTTConfig(_FirstOrder):
    """Back-propagation through time: the exact gradient of the return through physics and policy."""

    learning_rate: float = 4e-3
    """Adam's step at the start."""
    learning_rate_end: float = 1e-4
    """Adam's step at the end; exponential in between."""
    gamma: float = 0.99
    """Discount a step within the window."""
    average: float | None = None
    """Share of the old in a running mean of the policy, an update, at most; as long as there are few, their plain mean.
    The mean is judged and shipped. None: the policy itself (sets the program)."""


@dataclass(frozen=True)
class SHACConfig(_FirstOrder):
    """Short-horizon actor-critic (Xu et al. 2022): the exact gradient over a window, and a critic's beyond it."""

    horizon: int = 32
    """Steps of a window (sets shapes)."""
    epochs: int = 4
    """Passes of the critic over the samples of a window (sets shapes)."""
    minibatch: int = 512
    """Samples of a gradient step of the critic; divides envs * horizon (sets shapes)."""
    learning_rate: float = 4e-3
    """Adam's step at the start."""
    learning_rate_end: float = 1e-4
    """Adam's step at the end; exponential in between."""
    critic_rate: float = 0.5
    """The critic's step over the policy's."""
    gamma: float = 0.98
    """Discount a step."""
    td_lambda: float = 0.95
    """Lambda of the returns that the critic learns."""
    target_share: float = 0.2
    """How far the critic's slow copy follows it, an update."""
    noise: float = 0.0
    """Standard deviation of the noise on the action."""


@dataclass(frozen=True)
class ABPTConfig(_FirstOrder):
    """Amended back-propagation through time (Li et al. 2025): windows of exact gradients between values of critics that
    learn from a replay buffer.
    """

    horizon: int = 32
    """Steps of a window (sets shapes)."""
    collect: int = 8
    """Steps of each environment into the replay buffer, an update (sets shapes)."""
    buffer: int = 65_536
    """Transitions in the replay buffer, a multiple of envs * collect (sets shapes)."""
    places: int = 1024
    """Visited states that windows may begin at, a multiple of envs (sets shapes)."""
    minibatch: int = 1024
    """Samples of a gradient step of the critics (sets shapes)."""
    fits: int = 8
    """Gradient steps of the critics, an update (sets shapes)."""
    learning_rate: float = 4e-3
    """Adam's step at the start."""
    learning_rate_end: float = 1e-4
    """Adam's step at the end; exponential in between."""
    critic_rate: float = 0.5
    """The critics' step over the policy's."""
    gamma: float = 0.98
    """Discount a step."""
    target_share: float = 0.02
    """How far the critics' slow copies follow them, a gradient step."""
    fresh_share: float = 0.5
    """Share of the windows that begin at a new start; the others begin at visited states."""
    at_once: float = 0.5
    """Weight of the critics' value of a window's first action; the window's own return has the rest."""
    entropy_weight: float = 1e-3
    """Weight of the entropy bonus."""
    log_std: float = -2.0
    """Initial log standard deviation of the action noise."""

    @property
    def steps(self) -> int:
        """Environment steps of an update."""
        return self.envs * (self.collect + self.horizon)


@dataclass(frozen=True)
class FOPPOConfig(_Proximal, _FirstOrder):
    """PPO refined by first-order gradients: epochs over a rollout, then a step along its exact gradient. Ours."""

    horizon: int = 32
    """Steps of a rollout, which is the window of the exact gradient (sets shapes)."""
    log_std: float = -1.5
    """Initial log standard deviation of the action noise."""
    exact_rate: float = 3.0
    """The step along the exact gradient over that of the epochs."""
    gamma: float = 0.98
    """Discount a step."""


AlgorithmConfig = PPOConfig | BPTTConfig | SHACConfig | ABPTConfig | FOPPOConfig

ALGORITHMS: dict[str, AlgorithmConfig] = {
    "ppo": PPOConfig(), "bptt": BPTTConfig(), "shac": SHACConfig(), "abpt": ABPTConfig(), "foppo": FOPPOConfig(),
}  # fmt: skip
"""Algorithms by name, with their defaults."""
