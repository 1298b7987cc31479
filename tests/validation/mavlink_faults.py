"""Faults of flights over MAVLink: twenty in a hover."""

from e2efly.flight.pilot.flight_state import Mode
from tests.validation.link_faults import (
    DOWN,
    Fault,
    flat,
    gust,
    hand,
    heard,
    late,
    no_poses,
    nothing,
    operator,
    unheard,
    wire,
)

FAULTS = (
    Fault("the bridge's process dies", nothing, True, bridge_lives=False),
    Fault("the bridge's process hangs for 0.2 s", nothing, False, (Mode.HOVER,), bridge_lives=False, flies=True,
          heals_after=0.2),
    Fault("the bridge's process hangs for 3 s", nothing, True, (Mode.PILOT, *DOWN), bridge_lives=False,
          heals_after=3.0),
    Fault("the link is gone", wire(alive=False), True, (Mode.LAND, Mode.PILOT, *DOWN)),
    Fault("nothing arrives at the autopilot", wire(up=False), True, (Mode.PILOT, *DOWN)),
    Fault("nothing comes from the autopilot", wire(down=False), False, DOWN),
    Fault("nothing arrives for 0.1 s", wire(up=False), False, (Mode.HOVER,), flies=True, heals_after=0.1,
          heal=wire(up=True)),
    Fault("nothing comes for 0.1 s", wire(down=False), False, (Mode.HOVER,), flies=True, heals_after=0.1,
          heal=wire(down=True)),
    Fault("the link is 30 ms late", late, False, (Mode.HOVER,), flies=True),
    Fault("the receiver is lost", unheard, True, (Mode.PILOT, *DOWN)),
    Fault("the receiver is lost for 0.2 s", unheard, False, (Mode.HOVER, Mode.LAND, *DOWN), heals_after=0.2,
          heal=heard, flies=True),
    Fault("the poses end", no_poses, False, DOWN),
    Fault("the battery is flat", flat, False, DOWN),
    Fault("the pilot takes the mode away", hand(override=False), False, (Mode.PILOT,), flies=True),
    Fault("the pilot takes it away and gives it back", hand(override=False), False, (Mode.HOVER,), flies=True,
          heals_after=2.0, heal=hand(override=True)),
    Fault("the pilot lands by the mission switch", hand(mission="land"), False, DOWN),
    Fault("the pilot moves the roll stick", hand(roll=0.5), False, (Mode.HOVER,), flies=True, heals_after=1.0,
          heal=hand(roll=0.0)),
    Fault("the operator ends the program", operator, False, DOWN),
    Fault("poses and receiver are lost", lambda rig, session: (no_poses(rig, session), unheard(rig, session))[0],
          True, (Mode.PILOT, *DOWN)),
    Fault("a gust of 4.5 m/s", gust, False, (Mode.HOVER,), flies=True),
)  # fmt: skip
"""Twenty faults in a hover."""
