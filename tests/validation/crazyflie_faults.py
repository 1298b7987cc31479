"""Faults of flights of a Crazyflie: twenty-four in a hover."""

from e2efly.flight.pilot.flight_state import Mode
from e2efly.validation.bridge_session import Session
from tests.flight.peer_rig import FlownPeer
from tests.validation.link_faults import (
    DOWN,
    Fault,
    flat,
    hand,
    heard,
    late,
    no_poses,
    nothing,
    operator,
    unheard,
    wire,
)


def _breeze(rig: FlownPeer, session: Session) -> None:
    del session
    rig.wind[:] = 1.5, 1.0, 0.0


def _lossy(rig: FlownPeer, session: Session) -> None:
    del session
    rig.wire.loss = 0.3


def _alone(rig: FlownPeer, session: Session) -> None:
    no_poses(rig, session)
    unheard(rig, session)


def _still(rig: FlownPeer, session: Session) -> None:
    del session
    rig.stop_watchdog()


FAULTS = (
    Fault("the bridge's process dies", nothing, True, bridge_lives=False),
    Fault("the bridge's process hangs for 0.1 s", nothing, False, (Mode.HOVER,), bridge_lives=False, flies=True,
          heals_after=0.1),
    Fault("the bridge's process hangs for 1 s", nothing, True, (Mode.PILOT, *DOWN), bridge_lives=False,
          heals_after=1.0),
    Fault("without a watchdog, the process dies", nothing, True, bridge_lives=False, falls=True, watched=False),
    Fault("without a watchdog, the process hangs for 0.2 s", nothing, False, (Mode.HOVER,), bridge_lives=False,
          flies=True, heals_after=0.2, watched=False),
    Fault("without a watchdog, the process hangs for 1 s", nothing, True, (Mode.HOVER,), bridge_lives=False,
          flies=True, heals_after=1.0, watched=False),
    Fault("the watchdog's process hangs", _still, True, DOWN, falls=True),
    Fault("the link is gone", wire(alive=False), True, (Mode.PILOT, *DOWN), falls=True),
    Fault("nothing arrives at the Crazyflie", wire(up=False), True, DOWN, falls=True),
    Fault("nothing comes from the Crazyflie", wire(down=False), False, DOWN),
    Fault("nothing arrives for 0.1 s", wire(up=False), False, (Mode.HOVER,), flies=True, heals_after=0.1,
          heal=wire(up=True)),
    Fault("nothing comes for 0.1 s", wire(down=False), False, (Mode.HOVER,), flies=True, heals_after=0.1,
          heal=wire(down=True)),
    Fault("nothing arrives for 1 s", wire(up=False), True, (Mode.HOVER, *DOWN), flies=True, heals_after=1.0,
          heal=wire(up=True)),
    Fault("the link is 30 ms late", late, False, (Mode.HOVER,), flies=True),
    Fault("the radio loses three packets of ten", _lossy, False, (Mode.HOVER,), flies=True),
    Fault("the terminal is gone", unheard, False, DOWN),
    Fault("the terminal is in the background for 0.2 s", unheard, False, (Mode.HOVER, *DOWN), heals_after=0.2,
          heal=heard),
    Fault("the poses end", no_poses, False, DOWN),
    Fault("poses and terminal are gone", _alone, False, DOWN),
    Fault("the battery is flat", flat, False, DOWN),
    Fault("the pilot lands by Enter", hand(mission="land"), False, DOWN),
    Fault("the pilot types off", hand(armed=False, mission="land"), False, (Mode.INIT, Mode.DONE), falls=True),
    Fault("the operator ends the program", operator, False, DOWN),
    Fault("a wind of 1.8 m/s", _breeze, False, (Mode.HOVER,), flies=True),
)  # fmt: skip
