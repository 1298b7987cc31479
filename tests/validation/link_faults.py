"""Faults of flights over a link: what each does, and how its end is judged."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from e2efly.flight.pilot.flight_state import Mode
from e2efly.validation.bridge_session import Session
from tests.faults.fault_run import TOUCH_SPEED
from tests.flight.peer_rig import FlownPeer


@dataclass(frozen=True)
class Fault:
    """One thing that fails in a hover."""

    name: str
    begin: Callable[[FlownPeer, Session], None]
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
    falls: bool = False
    """Whether the motors stop in the air, as documented: nothing is asked of the touch."""
    watched: bool = True
    """Whether the bridge has its watchdog, where there is one for the autopilot."""
    heals_after: float | None = None
    """The fault ends after this time, s. None: it lasts."""
    heal: Callable[[FlownPeer, Session], None] = lambda rig, session: None


def wire(**what: bool) -> Callable[[FlownPeer, Session], None]:
    def begin(rig: FlownPeer, session: Session) -> None:
        del session
        for name, value in what.items():
            setattr(rig.wire, name, value)

    return begin


def nothing(rig: FlownPeer, session: Session) -> None:
    del rig, session


def unheard(rig: FlownPeer, session: Session) -> None:
    del session
    rig.heard = False


def heard(rig: FlownPeer, session: Session) -> None:
    del session
    rig.heard = True


def no_poses(rig: FlownPeer, session: Session) -> None:
    del rig
    session.source.read = lambda now: []  # type: ignore[method-assign]


def flat(rig: FlownPeer, session: Session) -> None:
    del session
    rig.volts *= 3.4 / 3.9


def hand(**what: object) -> Callable[[FlownPeer, Session], None]:
    def begin(rig: FlownPeer, session: Session) -> None:
        del session
        rig.set(**what)

    return begin


def operator(rig: FlownPeer, session: Session) -> None:
    del rig
    session.bridge.land_now = True


def gust(rig: FlownPeer, session: Session) -> None:
    del session
    rig.wind = np.array([4.0, 2.0, 0.0])


def late(rig: FlownPeer, session: Session) -> None:
    del session
    rig.wire.delay = 0.03


DOWN = (Mode.DONE, Mode.INIT, Mode.LAND)


@dataclass(frozen=True)
class FaultEnd:
    """How a flight with a fault ended."""

    good: bool
    told: str


def flown(rig: FlownPeer, session: Session, fault: Fault) -> FaultEnd:
    """Fly into a fault out of a hover, and judge the end."""
    rig.plan(session.bridge)
    before = len(rig.log)
    fault.begin(rig, session)
    place = np.array(rig.state.position[:2])
    begun, fastest, alive = rig.now(), 0.0, fault.bridge_lives
    healed, high = fault.heals_after is None, True
    while rig.now() < begun + fault.seconds:
        if not healed and fault.heals_after is not None and rig.now() >= begun + fault.heals_after:
            fault.heal(rig, session)
            alive = healed = True
        sinks = -float(rig.state.velocity[2])
        if alive:
            session.step()
            rig.plan(session.bridge)
        else:
            rig.sleep(session.period)
        now_high = float(rig.state.position[2]) > rig.world.vehicle.feet_height + 0.01
        fastest = max(fastest, sinks) if high and not now_high else fastest
        high = now_high
    acted = any(line.startswith("failsafe") for line in rig.log[before:])
    down = not high
    mode, tilt = session.bridge.flight.mode, 1 - 2 * float(np.sum(np.square(rig.state.quaternion[1:3])))
    aside = float(np.linalg.norm(rig.state.position[:2] - place))
    told = f"{mode}, {'down' if down else 'flies'}, touch {fastest:.2f} m/s, {aside:.2f} m aside, " + "; ".join(
        rig.log[before:]
    )
    good = (
        acted is fault.autopilot_acts
        and down is not fault.flies
        and (fault.falls or (fastest < TOUCH_SPEED and tilt > 0.9))
        and (not alive or mode in fault.ends)
    )
    return FaultEnd(good, told)
