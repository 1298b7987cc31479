"""Ask the policy in a thread of its own, so that a slow or stuck policy never holds up the control loop."""

import time
from concurrent.futures import Future, ThreadPoolExecutor
from concurrent.futures import TimeoutError as Late

from e2efly.deploy.odometry import Odometry
from e2efly.deploy.runtime import Decision, Imu, Runtime, RuntimeState, act, begin, due, outside


class PolicyWorker:
    """The policy of a flight. None of its methods raises for what the policy does."""

    def __init__(self, runtime: Runtime, timeout: float) -> None:
        self.runtime, self.timeout = runtime, timeout
        """The policy with its goal; how long a step waits for it, s."""
        self.state: RuntimeState | None = None
        """Of the flight under way."""
        self.decision: Decision | None = None
        """The last one: it is flown until the next is due."""
        self.problem: str | None = None
        """Why the policy failed in this flight."""
        self._pool = ThreadPoolExecutor(1, "policy")
        self._running: Future | None = None

    @property
    def done(self) -> bool:
        """Its task is over."""
        return self.state is not None and self.runtime.goal.done(self.state.goal)

    def readiness(self, odometry: Odometry, now: float) -> str | None:
        """Why it must not take over now; None: it may."""
        if self._running is not None and not self._running.done():
            return "it is still busy with an earlier question"
        return "; ".join(outside(self.runtime, odometry, now)) or None

    def start(self, odometry: Odometry, now: float) -> None:
        """It takes over."""
        self.problem = self.decision = None
        self.state = begin(self.runtime, odometry, now)

    def stop(self) -> None:
        """It flies no more."""
        self.state = self.decision = None

    def step(self, odometry: Odometry, now: float, slack: float, imu: Imu | None) -> bool:
        """Ask it, where it is due within `slack` s; whether it has decided anew. What goes wrong is in `problem`."""
        state = self.state
        if state is None or now + slack < due(self.runtime, state):
            return False
        started = time.perf_counter()
        try:
            self._running = self._pool.submit(act, self.runtime, state, odometry, now, imu)
            self.state, self.decision = self._running.result(self.timeout)
        except Late:
            self.problem = f"late: no answer within {1e3 * (time.perf_counter() - started):.0f} ms"
        except Exception as error:  # whatever a policy does, the vehicle goes on flying
            self.problem = str(error) or type(error).__name__
        else:
            self.problem = self.runtime.goal.failed(self.state.goal) or None
            return True
        return False

    def close(self) -> None:
        """End the thread, once the policy lets it."""
        self._pool.shutdown(wait=False, cancel_futures=True)
