"""Call the policy in its own thread, so that a slow or stuck policy never delays the control loop."""

import dataclasses
import os
import threading
import time
from collections.abc import Sequence
from concurrent.futures import Future
from concurrent.futures import TimeoutError as Late
from contextlib import suppress
from dataclasses import dataclass
from queue import SimpleQueue
from typing import Any, Protocol

import numpy as np

from e2efly.config.domain import Domain
from e2efly.policy.images import Image
from e2efly.policy.observation import INERTIAL
from e2efly.policy.odometry import Odometry
from e2efly.policy.others import Others
from e2efly.policy.runtime import Decision, Imu, Runtime, RuntimeState, act, begin, due, outside
from e2efly.vehicles.gravity import GRAVITY


@dataclass(frozen=True)
class Sensed:
    """What a step decides by."""

    odometry: Odometry
    """The newest motion."""
    imu: Imu | None = None
    """The newest measurement, if there is one."""
    images: Sequence[np.ndarray] = ()
    """The newest image of each camera, in the order of `Worker.images`."""
    others: Others | None = None
    """The nearest other vehicles, `Worker.neighbours` at most."""
    attitude: np.ndarray | None = None
    """(4,) the flight controller's own attitude, unit quaternion wxyz, for a worker that is `unplaced`."""


class Worker(Protocol):
    """What flies in mode POLICY: a policy, or commands from another program (`e2efly.flight.commander`). It never
    raises.
    """

    name: str
    """The name in the log."""
    state: Any
    """State of the current flight. None: it does not fly."""
    decision: Decision | None
    """The last decision. It is flown until the next one."""
    problem: str | None
    """The reason for its failure in this flight."""

    @property
    def native_id(self) -> int | None:
        """The operating system's id of its thread. None: it has no thread."""
        ...

    @property
    def images(self) -> tuple[Image, ...]:
        """The images that it sees."""
        ...

    @property
    def sensing(self) -> Domain | None:
        """The sensing that its training covered. None: not declared, or it was not trained."""
        ...

    @property
    def lands(self) -> bool:
        """Whether its task is to land."""
        ...

    @property
    def done(self) -> bool:
        """Whether its task is over."""
        ...

    @property
    def neighbours(self) -> int:
        """Number of the nearest other vehicles that it observes."""
        ...

    @property
    def unplaced(self) -> bool:
        """Whether of the motion it is shown only where up is: then by the flight controller's own attitude."""
        ...

    def hear(self, odometry: Odometry | None, now: float) -> None:
        """Receive new data for it. Called at every control step, whatever flies."""
        ...

    def readiness(self, odometry: Odometry, now: float) -> str | None:
        """The reason why it must not take over now. None: it may."""
        ...

    def start(self, odometry: Odometry, now: float) -> None:
        """Let it take over."""
        ...

    def stop(self) -> None:
        """Stop its flight."""
        ...

    def step(self, sensed: Sensed, now: float, slack: float) -> bool:
        """Let it decide at `now` s, if it is due within `slack` s. Returns whether there is a new decision."""
        ...

    def close(self) -> None:
        """Release all resources."""
        ...


class PolicyWorker:
    """The policy of a flight. No method raises, whatever the policy does."""

    name = "policy"

    def __init__(self, runtime: Runtime, timeout: float) -> None:
        self.runtime, self.timeout = runtime, timeout
        """The policy with its goal, and how long a step waits for it, s."""
        self.state: RuntimeState | None = None
        """State of the current flight."""
        self.last: RuntimeState | None = None
        """The newest state of the current flight, or of the last one."""
        self.decision: Decision | None = None
        """The last decision. It is flown until the next one is due."""
        self.problem: str | None = None
        """The reason for the policy's failure in this flight."""
        self._questions: SimpleQueue[tuple[Future, RuntimeState, Sensed, float] | None] = SimpleQueue()
        self._running: Future | None = None
        # a daemon: not even a policy that never answers keeps the program from ending
        self._thread = threading.Thread(target=self._answer, name="policy", daemon=True)
        self._thread.start()

    @property
    def native_id(self) -> int:
        """The operating system's id of its thread."""
        assert self._thread.native_id is not None
        return self._thread.native_id

    @property
    def images(self) -> tuple[Image, ...]:
        """The images that the contract names."""
        return self.runtime.policy.contract.images

    @property
    def sensing(self) -> Domain | None:
        """The sensing that its contract declares. None: it declares none."""
        return self.runtime.policy.contract.sensing

    @property
    def lands(self) -> bool:
        """Whether its task is to land."""
        return self.runtime.course.goal.lands

    @property
    def neighbours(self) -> int:
        """Number of the nearest other vehicles that the policy observes."""
        return getattr(self.runtime.course.goal, "neighbours", 0)

    @property
    def unplaced(self) -> bool:
        """Whether its contract has nothing but the attitude, an IMU and past actions."""
        return {field.name for field in self.runtime.policy.contract.observation} <= INERTIAL

    @property
    def done(self) -> bool:
        """Whether its task is over."""
        return self.state is not None and self.state.done

    def hear(self, odometry: Odometry | None, now: float) -> None:
        """Do nothing: a policy receives no data."""

    def readiness(self, odometry: Odometry, now: float) -> str | None:
        """The reason why it must not take over now. None: it may."""
        if self._busy:
            return "it is still busy with an earlier question"
        return "; ".join(outside(self.runtime, odometry, now)) or None

    def start(self, odometry: Odometry, now: float) -> None:
        """Let it take over."""
        self.problem = self.decision = None
        self.state = begin(self.runtime, odometry, now)

    def stop(self) -> None:
        """Stop its flight."""
        self.state = self.decision = None

    def step(self, sensed: Sensed, now: float, slack: float) -> bool:
        """Call the policy if it is due. Returns whether it made a new decision. Errors are in `problem`."""
        state = self.state
        if state is None or now + slack < due(self.runtime, state):
            return False
        if self._busy:
            self.problem = "late: it is still busy with an earlier question"
            return False
        started = time.perf_counter()
        self._running = Future()
        self._questions.put((self._running, state, sensed, now))
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
        """End the thread as soon as the policy returns."""
        self._questions.put(None)

    @property
    def _busy(self) -> bool:
        return self._running is not None and not self._running.done()

    def _answer(self) -> None:
        with suppress(Exception):  # a question in flight will tell
            _try_out(self.runtime)
        while (question := self._questions.get()) is not None:
            future, state, s, now = question
            seen = None if s.attitude is None else dataclasses.replace(s.odometry, quaternion=s.attitude)
            try:
                decided = act(self.runtime, state, s.odometry, now, s.imu, seen=seen, images=s.images, others=s.others)
                future.set_result(decided)
            except Exception as error:  # told to whoever waits for it
                future.set_exception(error)


def _try_out(runtime: Runtime) -> None:
    """Call the policy once without effect, in the thread that is used in flight: the first call takes longer than
    others.
    """
    course, zero = runtime.course, np.zeros(3)
    still = Odometry(0.0, np.asarray(course.origin.points(course.start)), zero, np.array([1.0, 0.0, 0.0, 0.0]), zero)
    images = [np.zeros(image.shape, np.float32) for image in runtime.policy.contract.images]
    act(runtime, begin(runtime, still, 0.0), still, 0.0, Imu(zero, np.array([0.0, 0.0, GRAVITY])), images=images)
