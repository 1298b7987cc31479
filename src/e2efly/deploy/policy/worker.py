"""Ask the policy in a thread of its own, so that a slow or stuck policy never holds up the control loop."""

import os
import threading
import time
from collections.abc import Sequence
from concurrent.futures import Future
from concurrent.futures import TimeoutError as Late
from contextlib import suppress
from queue import SimpleQueue
from typing import Any, Protocol

import numpy as np

from e2efly.deploy.odometry import Odometry
from e2efly.deploy.policy.images import Image
from e2efly.deploy.policy.runtime import Decision, Imu, Runtime, RuntimeState, act, begin, due, outside
from e2efly.vehicles.vehicle import GRAVITY


class Worker(Protocol):
    """What flies in mode POLICY: a policy, or a commander outside (`e2efly.deploy.commander`). Nothing here raises."""

    name: str
    """What the log calls it."""
    state: Any
    """Of the flight under way; None: it does not fly."""
    decision: Decision | None
    """The last one: it is flown until the next."""
    problem: str | None
    """Why it failed in this flight."""

    @property
    def native_id(self) -> int | None:
        """Of its thread, as the operating system knows it; None: it has none."""
        ...

    @property
    def images(self) -> tuple[Image, ...]:
        """What it sees."""
        ...

    @property
    def lands(self) -> bool:
        """Its task is to land."""
        ...

    @property
    def done(self) -> bool:
        """Its task is over."""
        ...

    def hear(self, odometry: Odometry | None, now: float) -> None:
        """At every control step, whoever flies: take in what has come for it."""
        ...

    def readiness(self, odometry: Odometry, now: float) -> str | None:
        """Why it must not take over now; None: it may."""
        ...

    def start(self, odometry: Odometry, now: float) -> None:
        """It takes over."""
        ...

    def stop(self) -> None:
        """It flies no more."""
        ...

    def step(
        self, odometry: Odometry, now: float, slack: float, imu: Imu | None, images: Sequence[np.ndarray] = ()
    ) -> bool:
        """Let it decide; whether there is something new to record."""
        ...

    def close(self) -> None:
        """Let go of everything."""
        ...


class PolicyWorker:
    """The policy of a flight. None of its methods raises for what the policy does."""

    name = "policy"

    def __init__(self, runtime: Runtime, timeout: float) -> None:
        self.runtime, self.timeout = runtime, timeout
        """The policy with its goal; how long a step waits for it, s."""
        self.state: RuntimeState | None = None
        """Of the flight under way."""
        self.last: RuntimeState | None = None
        """The newest of the flight under way, or of the last one."""
        self.decision: Decision | None = None
        """The last one: it is flown until the next is due."""
        self.problem: str | None = None
        """Why the policy failed in this flight."""
        self._questions: SimpleQueue[tuple[Future, tuple[Any, ...]] | None] = SimpleQueue()
        self._running: Future | None = None
        # a daemon: not even a policy that never answers keeps the program from ending
        self._thread = threading.Thread(target=self._answer, name="policy", daemon=True)
        self._thread.start()

    @property
    def native_id(self) -> int:
        """Of its thread, as the operating system knows it."""
        assert self._thread.native_id is not None
        return self._thread.native_id

    @property
    def images(self) -> tuple[Image, ...]:
        """What its contract says that it sees."""
        return self.runtime.policy.contract.images

    @property
    def lands(self) -> bool:
        """Its task is to land."""
        return self.runtime.course.goal.lands

    @property
    def done(self) -> bool:
        """Its task is over."""
        return self.state is not None and self.state.done

    def hear(self, odometry: Odometry | None, now: float) -> None:
        """Nothing comes for a policy."""

    def readiness(self, odometry: Odometry, now: float) -> str | None:
        """Why it must not take over now; None: it may."""
        if self._busy:
            return "it is still busy with an earlier question"
        return "; ".join(outside(self.runtime, odometry, now)) or None

    def start(self, odometry: Odometry, now: float) -> None:
        """It takes over."""
        self.problem = self.decision = None
        self.state = begin(self.runtime, odometry, now)

    def stop(self) -> None:
        """It flies no more."""
        self.state = self.decision = None

    def step(
        self, odometry: Odometry, now: float, slack: float, imu: Imu | None, images: Sequence[np.ndarray] = ()
    ) -> bool:
        """Ask it, where it is due within `slack` s; whether it has decided anew. What goes wrong is in `problem`."""
        state = self.state
        if state is None or now + slack < due(self.runtime, state):
            return False
        if self._busy:
            self.problem = "late: it is still busy with an earlier question"
            return False
        started = time.perf_counter()
        self._running = Future()
        self._questions.put((self._running, (self.runtime, state, odometry, now, imu, images)))
        try:
            state, self.decision = self._running.result(self.timeout)
        except Late:
            self.problem = f"late: no answer within {1e3 * (time.perf_counter() - started):.0f} ms"
            with suppress(OSError, AttributeError):  # should it never come back, others must run
                os.sched_setscheduler(self.native_id, os.SCHED_OTHER, os.sched_param(0))
        except Exception as error:  # whatever a policy does, the vehicle goes on flying
            self.problem = str(error) or type(error).__name__
        else:
            self.state = self.last = state
            self.problem = state.failure or None
            return True
        return False

    def close(self) -> None:
        """End the thread, once the policy lets it."""
        self._questions.put(None)

    @property
    def _busy(self) -> bool:
        return self._running is not None and not self._running.done()

    def _answer(self) -> None:
        with suppress(Exception):  # a question in flight will tell
            _try_out(self.runtime)
        while (question := self._questions.get()) is not None:
            future, asked = question
            try:
                *known, images = asked
                future.set_result(act(*known, images=images))
            except Exception as error:  # told to whoever waits for it
                future.set_exception(error)


def _try_out(runtime: Runtime) -> None:
    """Ask once for nothing, in the thread that will be asked in flight: the first answer takes longer than others."""
    course, zero = runtime.course, np.zeros(3)
    still = Odometry(0.0, np.asarray(course.origin.points(course.start)), zero, np.array([1.0, 0.0, 0.0, 0.0]), zero)
    images = [np.zeros(image.shape, np.float32) for image in runtime.policy.contract.images]
    act(runtime, begin(runtime, still, 0.0), still, 0.0, Imu(zero, np.array([0.0, 0.0, GRAVITY])), images=images)
