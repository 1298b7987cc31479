"""Whether poses and velocities come as the training of a policy covered it: what was measured beside the contract."""

from dataclasses import dataclass

from e2efly.config.domain import Domain
from e2efly.flight.pilot.estimate import StateEstimate

WATCHED_S = 5.0
"""How long the sensing is still judged after a policy has taken over, s."""
BORNE = {"velocity_lag": 0.025, "body_rate_lag": 0.015, "pose_age": 0.03, "hold": 0.05}
"""What every policy bears, also one that was trained without any, s. The bridge's own estimates from poses are 21 and
11 ms late, and each flight of a policy by poses alone has them. An age of 30 ms and a hole of 50 ms are those of a
usual motion capture that loses messages."""
STILL = "not measured: not enough motion"
REMEDIES = {
    "velocity_lag": "a source with a quicker velocity or with none, or a training with --env.estimate.velocity-lag",
    "body_rate_lag": "a source with a quicker body rate or with none, or a training with --env.estimate.body-rate-lag",
    "pose_age": "a quicker source, or a training with --env.observation-latency",
    "hold": "a source that comes more often, or a training with --env.estimate.hold",
}
"""What can be done about each quantity."""


@dataclass(frozen=True)
class SensedQuantity:
    """A quantity of `e2efly.policy.contract.SENSING`, as it was measured."""

    name: str
    seconds: float | None
    """What was measured, s. None: nothing was."""
    deviation: float = 0.0
    """Standard deviation of `seconds`, s."""
    about: str = ""
    """How it was measured, or why it was not."""

    @property
    def said(self) -> str:
        """The value, in words."""
        if self.seconds is None:
            return self.about
        within = f" (within {round(2e3 * self.deviation)} ms)" if self.deviation else ""
        return f"{round(1e3 * self.seconds)} ms{within}{self.about}"

    def covered(self, trained: Domain | None) -> float | None:
        """The largest value that a training covered, or that every policy bears, s. None: it is not declared."""
        most = next((part.high for part in trained or () if part.name == self.name), None)
        return None if most is None else max(most, BORNE[self.name])

    def problem(self, trained: Domain | None) -> str | None:
        """The value, what is accepted, and what can be done, in words. None: it is covered, or not known."""
        covered = self.covered(trained)
        if self.seconds is None or covered is None or self.seconds - 2 * self.deviation <= covered:
            return None
        return (
            f"{self.name} is {self.said}; accepted: up to {1e3 * covered:.0f} ms, as the policy's training covers; "
            f"{REMEDIES[self.name]}; --flight.untrained-sensing flies nonetheless"
        )


def sensed(estimate: StateEstimate) -> tuple[SensedQuantity, ...]:
    """What is known of the sensing."""
    checks, delay, hole = estimate.checks, estimate.delay, estimate.pace.hole
    found = []
    for name, given, known, lag in zip(
        ("velocity_lag", "body_rate_lag"), estimate.given, (checks.velocity_lag, checks.rate_lag), estimate.lag,
        strict=True,
    ):  # fmt: skip
        if not given:
            found.append(SensedQuantity(name, known, about=" later than the poses, from which it is estimated"))
        elif lag is None:
            found.append(SensedQuantity(name, None, about=STILL))
        else:
            found.append(SensedQuantity(name, lag.seconds, lag.deviation, " later than the poses"))
    age = (None, 0.0, STILL) if delay is None else (delay.seconds + checks.latency, delay.deviation, " by the gyro")
    watched = "not measured: watched too shortly" if hole is None else " without a new pose, twice or more"
    return (*found, SensedQuantity("pose_age", *age), SensedQuantity("hold", hole, about=watched))


def sensing_problem(estimate: StateEstimate, trained: Domain | None) -> str | None:
    """Why a policy of this training must not fly by this sensing, in words. None: it may, or nothing is declared."""
    return "; ".join(text for part in sensed(estimate) if (text := part.problem(trained))) or None
