"""Opens the autopilot that the text of a link names."""

import time

from e2efly.config.registry import check_methods, load, referenced
from e2efly.flight.autopilot import METHODS, Autopilot
from e2efly.flight.betaflight import watchdog as betaflight_watchdog
from e2efly.flight.betaflight.autopilot import AIDING_SCHEDULE, EXCITATION_SCHEDULE, Betaflight, check_hover
from e2efly.flight.betaflight.client import SCHEDULE
from e2efly.flight.crazyflie import crazyflie_watchdog
from e2efly.flight.crazyflie.crazyflie_autopilot import Crazyflie
from e2efly.flight.crazyflie.crtp_link import CRAZYFLIE, RADIO, open_crtp
from e2efly.flight.crazyflie.words import Words
from e2efly.flight.descent_plan import DescentWatchdog
from e2efly.flight.flight_loop import Watchdog
from e2efly.flight.landing_plan import LandingWatchdog
from e2efly.flight.link import Link, open_link
from e2efly.flight.mavlink.mavlink import Mavlink
from e2efly.flight.pilot.hovering import ROTOR_SPEED, HoverController
from e2efly.flight.settings import FlightSettings
from e2efly.flight.watched_link import WatchedLink
from e2efly.vehicles.vehicle import Vehicle

MAVLINK = "mavlink:"
"""Begins the text of a link to an autopilot that speaks MAVLink."""
CONNECT_S = 5.0
"""How long an autopilot may take to send its first answer, s."""


def open_autopilot(
    target: str,
    vehicle: Vehicle,
    settings: FlightSettings,
    hover: tuple[str, HoverController],
    *,
    watched: bool,
    excited: bool,
    aids: bool = False,
) -> tuple[Autopilot, Watchdog | None]:
    """Connect to an autopilot, and identify it. `close` of the autopilot closes the link.

    Args:
        target: the text of the link; `mavlink:` and a link; `radio://` or `crazyflie:` for a Crazyflie; or a reference
            to a class of one's own, path/to/file.py:Name[:...], which is made with the text after it and `settings`,
            and is an `Autopilot`.
        vehicle: the vehicle that flies.
        settings: the limits of the flight, with the pilot's channels.
        hover: name of the hover controller, and the controller, which may need more telemetry.
        watched: a watchdog holds the link, where the autopilot does not land by itself when commands end.
        excited: the flight is one of identification, which needs more measurements.
        aids: its IMU carries the poses on (`AidedSource`).

    Returns:
        The autopilot, and its watchdog, if it has one.

    Raises:
        ValueError: the text is not valid, or the autopilot is none that can be flown.
        OSError: the link does not connect.
        TimeoutError: nothing answers.
    """
    if target.startswith(MAVLINK):
        return _mavlink(target, settings, hover), None
    if target.startswith((CRAZYFLIE, RADIO)):
        return _crazyflie(target, vehicle, settings, hover, watched=watched)
    if (own := referenced(target)) is not None:
        made = load(own[0])(own[1], settings)
        check_methods(made, METHODS)
        try:
            made.identify(CONNECT_S)
        except BaseException:
            made.close()
            raise
        return made, None
    program, timeout = betaflight_watchdog.PROGRAM, betaflight_watchdog.TIMEOUT_S
    held: Link = WatchedLink(program, target, timeout) if watched else open_link(target)
    try:
        _connect(held, target)
        schedule = AIDING_SCHEDULE if aids else EXCITATION_SCHEDULE if excited else SCHEDULE
        autopilot = Betaflight.connect(held, settings, schedule, hover=hover[1], timeout=CONNECT_S)
        check_hover(*hover, autopilot.info)
    except BaseException:
        held.close()
        raise
    return autopilot, DescentWatchdog(held, autopilot) if isinstance(held, WatchedLink) else None


def check_link(target: str) -> None:
    """Refuse a text that names no link, and no autopilot of one's own.

    Raises:
        ValueError: the message names it and what is accepted.
    """
    if (own := referenced(target)) is not None:
        load(own[0])
    elif target.startswith((CRAZYFLIE, RADIO)):
        open_crtp(target).close()
    else:
        open_link(target.removeprefix(MAVLINK)).close()


def _mavlink(target: str, settings: FlightSettings, hover: tuple[str, HoverController]) -> Autopilot:
    """PX4 or ArduCopter. It lands by itself when commands end: nothing may go on sending in this program's place."""
    held = open_link(target.removeprefix(MAVLINK))
    try:
        _connect(held, target)
        autopilot = Mavlink.connect(held, settings, CONNECT_S)
        if ROTOR_SPEED in hover[1].needs:
            autopilot.poll(time.monotonic())
            if autopilot.rotor_speeds(time.monotonic(), CONNECT_S) is None:
                raise ValueError(
                    f"--hover is {hover[0]!r}, which needs the speeds of the rotors, and no ESC_TELEMETRY_1_TO_4 "
                    "comes; accepted: geometric, mpc or pid, or ESCs that tell their speed"
                )
    except BaseException:
        held.close()
        raise
    return autopilot


def _crazyflie(
    target: str, vehicle: Vehicle, settings: FlightSettings, hover: tuple[str, HoverController], *, watched: bool
) -> tuple[Autopilot, Watchdog | None]:
    """A Crazyflie, whose pilot types into this terminal. Without a watchdog, it falls when commands end."""
    if ROTOR_SPEED in hover[1].needs:
        raise ValueError(
            f"--hover is {hover[0]!r}, which needs the speeds of the rotors, and a Crazyflie tells none; accepted: "
            "geometric, mpc or pid"
        )
    program, timeout = crazyflie_watchdog.PROGRAM, crazyflie_watchdog.TIMEOUT_S
    held: Link = WatchedLink(program, target, timeout) if watched else open_crtp(target)
    try:
        _connect(held, target)
        autopilot = Crazyflie.connect(held, vehicle, settings, Words(), CONNECT_S)
    except BaseException:
        held.close()
        raise
    return autopilot, LandingWatchdog(held) if isinstance(held, WatchedLink) else None


def _connect(link: Link, target: str) -> None:
    end = time.monotonic() + CONNECT_S
    while not link.alive and time.monotonic() < end:
        link.poll(time.monotonic())
        time.sleep(0.01)
    if not link.alive:
        raise OSError(f"--link {target}: {link.reason}")
