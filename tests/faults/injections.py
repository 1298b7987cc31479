"""Faults with parameters that may strike together, by name: of accelerometer, link, receiver and body, and others."""

import dataclasses
import math
import struct
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from e2efly.flight.betaflight.allowed_modes import FAILSAFE
from e2efly.flight.betaflight.messages import RawImu, StatusEx
from tests.faults.injected_companion import COMPANION
from tests.faults.injected_fliers import FLIERS
from tests.faults.injected_poses import POSES
from tests.faults.injection import Excuse, Injection, Kind, Parameters, Rule, held, one_of, uniform, vector
from tests.faults.stage import Stage

COUNTS = 256
"""Of the firmware's accelerometer for one gravity."""
FAILSAFE_S = 0.5
"""Silence of the receiver after which the rig's firmware begins its failsafe, s: `failsafe_delay`."""
FLAGS = 6
"""Where a STATUS_EX has its flags of the modes that are on."""


def _told(change: Callable[[np.ndarray], np.ndarray]) -> Injection:
    """The accelerometer as the controller reports it: (3,) specific force, gravities, and what becomes of it."""

    def rewritten(payload: bytes) -> bytes:
        force = change(np.array(struct.unpack("<3h", payload[:6])) / COUNTS)
        return struct.pack("<3h", *np.clip(np.round(force * COUNTS), -32768, 32767).astype(int).tolist()) + payload[6:]

    return Injection(reply=(RawImu.CODE, rewritten))


def _told_frozen(stage: Stage) -> Injection:
    del stage
    kept: list[np.ndarray] = []

    def same(force: np.ndarray) -> np.ndarray:
        kept.append(force)
        del kept[1:]
        return kept[0]

    return _told(same)


def _felt(change: Callable[[np.ndarray], np.ndarray]) -> Injection:
    """The same as the controller's own sensor feels it, m/s^2."""
    return Injection(felt=lambda s: dataclasses.replace(s, specific_force=change(s.specific_force)))


def _scaled(on: Callable[..., Injection]) -> Callable[..., Injection]:
    return lambda stage, factor: on(lambda force: force * (1.0, 1.0, factor))


def _biased(on: Callable[..., Injection], gravity: float = 1.0) -> Callable[..., Injection]:
    return lambda stage, bias: on(lambda force: force + gravity * np.array(bias))


def _failsafe(stage: Stage) -> Injection:
    """The controller says that its receiver has failed, and goes on by the companion's sticks."""

    def failed(payload: bytes) -> bytes:
        bit = 1 << stage.session.autopilot.info.box_ids.index(FAILSAFE)
        flags = int.from_bytes(payload[FLAGS : FLAGS + 4], "little") | bit
        return payload[:FLAGS] + flags.to_bytes(4, "little") + payload[FLAGS + 4 :]

    return Injection(reply=(StatusEx.CODE, failed))


def _sag(stage: Stage, share: float, within: float) -> Injection:
    """All motors fall to a share of their output, s."""
    rig, began = stage.rig, stage.rig.now()
    before = rig.shares

    def fall() -> None:
        rig.shares = before * (1 - (1 - share) * min((rig.now() - began) / within, 1.0))

    return Injection(each=fall)


def _weak_motor(stage: Stage, motor: int, share: float) -> Injection:
    rig = stage.rig
    rig.shares = np.where(np.arange(4) == motor, share, 1.0) * rig.shares
    return Injection()


def _reboot(stage: Stage) -> Injection:
    stage.rig.power(False)
    return Injection(end=lambda: stage.rig.power(True))


HELD = Excuse("the firmware holds the last command while the link is silent")
NO_POWER = Excuse(
    "the controller has no power, and starts disarmed", (Rule.OFF, Rule.TOUCH, Rule.ENDLESS), for_good=True
)
UNHEARD = Excuse(
    "while its receiver is silent the firmware flies its failsafe, whatever the bridge sends", after=FAILSAFE_S
)
KINDS = POSES | COMPANION | FLIERS | {
    "accelerometer as told: z scaled": Kind(
        _scaled(_told), one_of("factor", -1.0, 0.0, 0.9, 0.93, 0.95, 0.97, 0.98, 1.03, 1.05, 1.1, 1.15)),
    "accelerometer as told: biased": Kind(
        _biased(_told), lambda random: {"bias": vector(random, random.uniform(0.01, 0.1))}),
    "accelerometer as told: frozen": Kind(_told_frozen),
    "accelerometer: z scaled": Kind(_scaled(_felt), uniform(factor=(0.9, 1.1))),
    "accelerometer: biased": Kind(
        _biased(_felt, 9.81), lambda random: {"bias": vector(random, random.uniform(0.01, 0.08))}),
    "link: silent": Kind(held("link", "silent", False), excuse=HELD, limited=(0.1, 5.0)),
    "link: garbage": Kind(held("link", "garbage", 0.0), uniform(value=(0.1, 0.9)), limited=(0.5, 10.0)),
    "link: spoilt": Kind(held("link", "spoilt", 0.0), uniform(value=(0.1, 1.0)), limited=(0.5, 10.0)),
    "link: late": Kind(held("link", "delay", 0.0), uniform(value=(0.01, 0.1)), limited=(0.5, 10.0)),
    "receiver: silent": Kind(held("rig", "heard", True), excuse=UNHEARD, limited=(0.1, 5.0)),
    "receiver: failsafe": Kind(_failsafe, limited=(0.1, 5.0)),
    "battery: sag": Kind(_sag, lambda random: {
        "share": round(float(random.uniform(0.8, 0.95)), 3), "within": round(float(random.uniform(0.1, 5.0)), 2)}),
    "motor: weak": Kind(_weak_motor, lambda random: {
        "motor": int(random.integers(4)), "share": round(float(random.uniform(0.85, 0.97)), 3)}),
    "controller: reboots": Kind(_reboot, excuse=NO_POWER, limited=(0.5, 2.0)),
}  # fmt: skip
"""All kinds, by name."""


@dataclass(frozen=True)
class Strike:
    """One fault of a flight: plain data."""

    kind: str
    """One of `KINDS`."""
    at: float = 0.0
    """When it begins after the flight has come to its mode, s; on the ground 0 is before the bridge was started."""
    lasts: float | None = None
    """How long, s; None: to the end."""
    parameters: Parameters = dataclasses.field(default_factory=dict)
    """Of its kind."""

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise ValueError(f"kind is {self.kind!r}; accepted: {', '.join(KINDS)}")


class Faults:
    """Those at work on a stage. Call `each` before every control step."""

    def __init__(self, stage: Stage) -> None:
        self._stage = stage
        self._active: list[tuple[float, Injection]] = []

    def attach(self) -> None:
        """To the stage's present link, poses and rig."""
        self._stage.poses.alter = partial(self._through, "pose")
        for code in (RawImu.CODE, StatusEx.CODE):
            self._stage.link.rewrites[code] = partial(self._reply, code)
        self._stage.rig.felt = partial(self._through, "felt")
        for camera in self._stage.cameras:
            camera.alter = partial(self._through, "frame")

    def begin(self, strike: Strike) -> None:
        ends = math.inf if strike.lasts is None else self._stage.rig.now() + strike.lasts
        self._active.append((ends, KINDS[strike.kind].begin(self._stage, **strike.parameters)))

    def each(self) -> None:
        """Go on with all of them, and end those that are over."""
        now = self._stage.rig.now()
        for ends, injection in self._active:
            (injection.each if now < ends else injection.end)()
        self._active = [(ends, injection) for ends, injection in self._active if now < ends]

    def _through(self, change: str, what: Any) -> Any:
        """A sample, an image or what sensors feel, altered by all of them in turn; None: it is lost."""
        for _, injection in self._active:
            if what is not None and (altered := getattr(injection, change)) is not None:
                what = altered(what)
        return what

    def _reply(self, code: int, payload: bytes) -> bytes:
        for _, injection in self._active:
            if injection.reply is not None and injection.reply[0] == code:
                payload = injection.reply[1](payload)
        return payload
