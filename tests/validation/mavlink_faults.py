"""Faults of flights over MAVLink: what each does, and how the flight must end."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from e2efly.flight.pilot.flight_state import Mode
from e2efly.validation.bridge_session import Session
from tests.faults.fault_run import TOUCH_SPEED
from tests.flight.mavlink_peer import MavlinkRig


@dataclass(frozen=True)
class Fault:
    """One thing that fails in a hover."""

    name: str
    begin: Callable[[MavlinkRig, Session], None]
    """Makes it fail."""
    autopilot_acts: bool
    """Whether the autopilot's own failsafe must end the flight. If not, the bridge does, or flies on."""
    ends: tuple[Mode, ...] = ()
    """Modes in which the bridge may be at the end, if it is alive."""
    bridge_lives: bool = True
    seconds: float = 14.0
    """How long the flight is watched, s."""
    flies: bool = False
    """Whether the vehicle still flies at the end."""
    heals_after: float | None = None
    """The fault ends after this time, s. None: it lasts."""
    heal: Callable[[MavlinkRig, Session], None] = lambda rig, session: None


def _wire(**what: bool) -> Callable[[MavlinkRig, Session], None]:
    def begin(rig: MavlinkRig, session: Session) -> None:
        del session
        for name, value in what.items():
            setattr(rig.wire, name, value)

    return begin


def _nothing(rig: MavlinkRig, session: Session) -> None:
    del rig, session


def _unheard(rig: MavlinkRig, session: Session) -> None:
    del session
    rig.heard = False


def _heard(rig: MavlinkRig, session: Session) -> None:
    del session
    rig.heard = True


def _no_poses(rig: MavlinkRig, session: Session) -> None:
    del rig
    session.source.read = lambda now: []  # type: ignore[method-assign]


def _flat(rig: MavlinkRig, session: Session) -> None:
    del session
    rig.volts = 4 * 3.4


def _hand(**what: object) -> Callable[[MavlinkRig, Session], None]:
    def begin(rig: MavlinkRig, session: Session) -> None:
        del session
        rig.set(**what)

    return begin


def _operator(rig: MavlinkRig, session: Session) -> None:
    del rig
    session.bridge.land_now = True


def _gust(rig: MavlinkRig, session: Session) -> None:
    del session
    rig.wind = np.array([4.0, 2.0, 0.0])


def _late(rig: MavlinkRig, session: Session) -> None:
    del session
    rig.wire.delay = 0.03


DOWN = (Mode.DONE, Mode.INIT, Mode.LAND)
FAULTS = (
    Fault("the bridge's process dies", _nothing, True, bridge_lives=False),
    Fault("the bridge's process hangs for 0.2 s", _nothing, False, (Mode.HOVER,), bridge_lives=False, flies=True,
          heals_after=0.2),
    Fault("the bridge's process hangs for 3 s", _nothing, True, (Mode.PILOT, *DOWN), bridge_lives=False,
          heals_after=3.0),
    Fault("the link is gone", _wire(alive=False), True, (Mode.LAND, Mode.PILOT, *DOWN)),
    Fault("nothing arrives at the autopilot", _wire(up=False), True, (Mode.PILOT, *DOWN)),
    Fault("nothing comes from the autopilot", _wire(down=False), False, DOWN),
    Fault("nothing arrives for 0.1 s", _wire(up=False), False, (Mode.HOVER,), flies=True, heals_after=0.1,
          heal=_wire(up=True)),
    Fault("nothing comes for 0.1 s", _wire(down=False), False, (Mode.HOVER,), flies=True, heals_after=0.1,
          heal=_wire(down=True)),
    Fault("the link is 30 ms late", _late, False, (Mode.HOVER,), flies=True),
    Fault("the receiver is lost", _unheard, True, (Mode.PILOT, *DOWN)),
    Fault("the receiver is lost for 0.2 s", _unheard, False, (Mode.HOVER, Mode.LAND, *DOWN), heals_after=0.2,
          heal=_heard, flies=True),
    Fault("the poses end", _no_poses, False, DOWN),
    Fault("the battery is flat", _flat, False, DOWN),
    Fault("the pilot takes the mode away", _hand(override=False), False, (Mode.PILOT,), flies=True),
    Fault("the pilot takes it away and gives it back", _hand(override=False), False, (Mode.HOVER,), flies=True,
          heals_after=2.0, heal=_hand(override=True)),
    Fault("the pilot lands by the mission switch", _hand(mission="land"), False, DOWN),
    Fault("the pilot moves the roll stick", _hand(roll=0.5), False, (Mode.HOVER,), flies=True, heals_after=1.0,
          heal=_hand(roll=0.0)),
    Fault("the operator ends the program", _operator, False, DOWN),
    Fault("poses and receiver are lost", lambda rig, session: (_no_poses(rig, session), _unheard(rig, session))[0],
          True, (Mode.PILOT, *DOWN)),
    Fault("a gust of 4.5 m/s", _gust, False, (Mode.HOVER,), flies=True),
)  # fmt: skip
"""Twenty faults in a hover."""


@dataclass(frozen=True)
class FaultEnd:
    """How a flight with a fault ended."""

    good: bool
    told: str


def flown(rig: MavlinkRig, session: Session, fault: Fault) -> FaultEnd:
    """Fly into a fault out of a hover, and judge the end."""
    before = len(rig.log)
    fault.begin(rig, session)
    begun, fastest, alive = rig.now(), 0.0, fault.bridge_lives
    healed, high = fault.heals_after is None, True
    while rig.now() < begun + fault.seconds:
        if not healed and fault.heals_after is not None and rig.now() >= begun + fault.heals_after:
            fault.heal(rig, session)
            alive = healed = True
        sinks = -float(rig.state.velocity[2])
        if alive:
            session.step()
        else:
            rig.sleep(session.period)
        now_high = float(rig.state.position[2]) > rig.world.vehicle.feet_height + 0.01
        fastest = max(fastest, sinks) if high and not now_high else fastest
        high = now_high
    acted = any(line.startswith("failsafe") for line in rig.log[before:])
    down = not high
    mode, tilt = session.bridge.flight.mode, 1 - 2 * float(np.sum(np.square(rig.state.quaternion[1:3])))
    told = f"{mode}, {'down' if down else 'flies'}, touch {fastest:.2f} m/s, {'; '.join(rig.log[before:])}"
    good = (
        acted is fault.autopilot_acts
        and down is not fault.flies
        and fastest < TOUCH_SPEED
        and tilt > 0.9
        and (not alive or mode in fault.ends)
    )
    return FaultEnd(good, told)
