"""Commands from outside: what they say, how far they may go, when they are too old, and how they come by UDP."""

import dataclasses
import math
import re
import socket
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from e2efly.commands.fly import Fly
from e2efly.commands.fly import run as fly_command
from e2efly.control import COMMAND_MODES
from e2efly.flight.commander.command import Limits, parse_command, within
from e2efly.flight.commander.commander import LEASH, Commander, Heading, heading
from e2efly.flight.commander.sources import open_commands
from e2efly.flight.commander.stream import STEADY_S, CommandStream, take
from e2efly.flight.settings import Fence, FlightSettings
from e2efly.policy.odometry import Odometry
from e2efly.policy.runtime import MODES, Envelope
from e2efly.policy.worker import Sensed
from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.loading import load_vehicle
from tests.flight.command_streams import Loopback, encode
from tests.flight.test_msp_client import controller, recorded
from tests.waiting import until

VEHICLE = load_vehicle("vis_r")
SETTINGS = FlightSettings()
LIMITS = Limits(VEHICLE, SETTINGS.fence, 3.0)
ZERO = np.zeros(3)
STILL = Odometry(100.0, np.array([0.0, 0.0, 1.0]), ZERO, np.array([1.0, 0, 0, 0]), ZERO)
GOOD: dict[str, dict[str, Any]] = {
    "position": {"position": [1, 0.5, 1.5], "yaw": 0.3},
    "velocity": {"velocity": [1, 0], "altitude": 1.5, "yaw_rate": -0.5},
    "acceleration": {"acceleration": [0, 1, -1]},
    "attitude": {"thrust": 9.5, "attitude": [0.1, -0.2, 3.0]},
    "ctbr": {"thrust": 12, "body_rate": [1, 2, -3]},
}


def said(mode: str = "position", **changes: Any) -> bytes:
    return encode(**{"mode": mode, **GOOD.get(mode, {}), **changes})


# Messages


def test_the_modes_are_those_that_become_collective_thrust_and_body_rates() -> None:
    assert set(GOOD) == set(MODES) == {name for name, mode in COMMAND_MODES.items() if mode.controller is not None}


@pytest.mark.parametrize("mode", GOOD)
def test_a_command_of_each_mode_is_read_and_within_the_limits_unchanged(mode: str) -> None:
    command = parse_command(said(mode, stamp=3.5, frame="map"), 7.0, "10.0.0.2:4000")
    assert (command.received, command.stamp, command.sender, command.mode) == (7.0, 3.5, "10.0.0.2:4000", mode)
    fitting = within(LIMITS, command, STILL)
    assert not fitting.clipped
    for key, value in GOOD[mode].items():
        if isinstance(value, list):
            np.testing.assert_array_equal(fitting.main[: len(value)], value)
        else:
            assert getattr(fitting, key) == value


@pytest.mark.parametrize(
    ("message", "accepted"),
    [
        (b"\xff", "not JSON"),
        (b"[1]", "accepted: an object with mode, position"),
        (encode(position=[0, 0, 1]), "mode is None; accepted: 'position' or 'velocity'"),
        (said("rotor_thrust"), "mode is 'rotor_thrust'; accepted: 'position' or"),
        (encode(mode="position"), "missing key 'position' of mode 'position'"),
        (encode(mode="ctbr", thrust=9.8), "missing key 'body_rate' of mode 'ctbr'"),
        (said("ctbr", yaw=1.0), "mode 'ctbr' has no key 'yaw'; accepted: body_rate, thrust"),
        (said("position", altitude=1.0), "mode 'position' has no key 'altitude'"),
        (said(yaw_rate=0.1), "yaw and yaw_rate are both given"),
        (said("velocity", velocity=[1, 2, 3]), r"velocity is \[1, 2, 3\]; accepted: a list of 2"),
        (encode(mode="velocity", velocity=[1, 2]), "accepted: a list of 3"),
        (said(position=[0, 0, "1"]), "accepted: a list of 3 finite numbers"),
        (said(position=[0, 0, True]), "accepted: a list of 3 finite numbers"),
        (said(position=[0, 0, math.nan]), "NaN is no number"),
        (said("ctbr", thrust=10**400), "thrust is 1000"),
        (said(frame="base_link"), "frame is 'base_link'; accepted: map, odom, world or none"),
        (said(stamp="now"), "stamp is 'now'; accepted: a finite number of seconds"),
        (said(positon=[0, 0, 1]), "unknown key 'positon'; did you mean 'position'"),
    ],
)
def test_what_is_no_command_is_refused_by_name(message: bytes, accepted: str) -> None:
    with pytest.raises(ValueError, match=accepted):
        parse_command(message, 7.0)


# Limits


def fitted(mode: str, **changes: Any) -> Any:
    return within(LIMITS, parse_command(said(mode, **changes), 7.0), STILL)


def test_a_number_somewhat_beyond_the_vehicle_s_limits_is_clipped_as_a_policy_s_is() -> None:
    most = VEHICLE.body_rate_max
    command = fitted("ctbr", thrust=-1.0, body_rate=[1.5 * most[0], -1.5 * most[1], 0])
    assert command.clipped
    assert command.thrust == 0
    np.testing.assert_allclose(command.main, [most[0], -most[1], 0])
    tilted = fitted("attitude", attitude=[1.5 * VEHICLE.tilt_max, 0, 3.5])
    np.testing.assert_allclose(tilted.main, [VEHICLE.tilt_max, 0, 3.5 - math.tau])
    assert not fitted("attitude", attitude=[0, 0, 3.5]).clipped
    assert fitted("position", yaw=-3.5).yaw == pytest.approx(math.tau - 3.5)


@pytest.mark.parametrize(
    ("mode", "changes", "accepted"),
    [
        ("ctbr", {"thrust": 1000.0}, "thrust is 1000 m/s.2; accepted: 0 to 27.31"),
        ("ctbr", {"body_rate": [300, 0, 0]}, "roll_rate is 300 rad/s; accepted: -10 to 10"),
        ("attitude", {"attitude": [0, 0, 90.0]}, "yaw is 90 rad"),
        ("attitude", {"attitude": [0, 10, 0]}, "pitch is 10 rad"),
        ("velocity", {"velocity": [0, 50]}, "velocity is 50 m/s; accepted: -5 to 5"),
        ("velocity", {"yaw_rate": 45}, "yaw_rate is 45 rad/s; accepted: -4 to 4"),
        ("velocity", {"altitude": 0.0}, "altitude is 0 m; accepted: 0.3 to 4.4, inside the fence"),
        ("velocity", {"altitude": 4.3}, "altitude is 3.3 m from the vehicle; accepted: at most 3"),
        ("acceleration", {"acceleration": [0, 0, -99]}, "acceleration is -99 m/s.2"),
        ("position", {"position": [0, 3, 1]}, "position is 3 m in y; accepted: -2.9 to 2.9, inside the fence"),
        ("position", {"position": [2.8, 2.8, 1]}, "position is 3.96 m from the vehicle; accepted: at most 3"),
        ("position", {"yaw": 90}, "yaw is 90 rad"),
    ],
)
def test_what_is_far_beyond_them_or_out_of_the_fence_is_refused(mode: str, changes: Any, accepted: str) -> None:
    with pytest.raises(ValueError, match=accepted):
        fitted(mode, **changes)


# Time


def followed(stream: CommandStream, message: bytes, received: float, **more: Any) -> CommandStream:
    sender = more.pop("sender", "")
    return take(stream, parse_command(message, received, sender), LIMITS, STILL, received, 0.2, **more)


def test_stamps_tell_the_age_and_what_is_late_goes_back_or_jumps_is_refused() -> None:
    stream = followed(CommandStream(), said(stamp=5.0), 100.01)
    stream = followed(stream, said(stamp=5.1), 100.16)  # 50 ms later than the first
    assert stream.time == pytest.approx(100.11, abs=1e-3)
    assert stream.age(100.16) == pytest.approx(0.05, abs=1e-3)
    for stamp, received, problem in (
        (5.1, 100.17, "accepted: later than that of the one before, 5.100"),
        (4.0, 100.18, "accepted: later than that of the one before, 5.100"),
        (9.0, 100.19, "a jump of the sender's clock by 3.8"),
        (5.12, 100.35, "it is 0.220 s old; accepted: at most 0.2"),
    ):
        after = followed(stream, said(stamp=stamp), received, flying=True)
        assert after.problem.endswith(problem) or problem in after.problem
        assert (after.command, after.time, after.refused) == (stream.command, stream.time, stream.refused + 1)
        assert math.isinf(after.since)


def test_a_clock_that_stands_ends_a_flight_and_only_then_the_stream_begins_anew() -> None:
    stream = followed(CommandStream(), said(stamp=5.0), 100.0)
    for i in range(1, 100):
        stream = followed(stream, said(stamp=5.0), 100.0 + 0.01 * i, flying=True)
    assert (stream.taken, stream.refused, stream.time) == (1, 99, 100.0)
    again = followed(stream, said(stamp=5.0), 101.0)
    assert (again.taken, again.time, again.since) == (2, 101.0, 101.0)


def test_of_two_commanders_the_first_one_commands_until_it_is_silent() -> None:
    stream = followed(CommandStream(), said(), 100.0, sender="a")
    other = followed(stream, said(), 100.1, sender="b")
    assert other.problem == "command: from b, while a commands; accepted: one commander"
    assert other.time == 100.0
    assert followed(other, said(), 100.3, sender="b").time == 100.3
    assert followed(other, said(), 100.3, sender="b", flying=True).time == 100.0


# In place of a policy


class Said:
    refused, problem = 0, None

    def __init__(self) -> None:
        self.waiting: list[bytes] = []

    def read(self, now: float) -> list[Any]:
        messages, self.waiting = self.waiting, []
        return [parse_command(message, now) for message in messages]

    def close(self) -> None: ...

    def describe(self) -> str:
        return "said"


def heard(commander: Commander, source: Said, since: float, until: float, message: bytes) -> float:
    now = since
    while now < until:
        source.waiting.append(message)
        commander.hear(STILL, now)
        now += 0.01
    return now


def test_it_takes_over_only_while_commands_come_steadily_and_the_vehicle_is_calm() -> None:
    source = Said()
    commander = Commander(source, VEHICLE, SETTINGS, envelope=Envelope(speed=1.0))
    assert commander.readiness(STILL, 100.0) == "no command has come yet"
    now = heard(commander, source, 100.0, 100.1, said())
    assert commander.readiness(STILL, now) == f"good commands have come for 0.10 s; accepted: {STEADY_S:g}"
    now = heard(commander, source, now, 101.0, said())
    assert commander.readiness(STILL, now) is None
    fast = dataclasses.replace(STILL, velocity=np.array([2.0, 0, 0]))
    assert commander.readiness(fast, now) == "speed is 2 m/s; accepted: at most 1"
    source.waiting.append(said(position=[0, 0, 9]))
    commander.hear(STILL, now)
    assert "accepted: 0.3 (command: position is 9 m in z" in str(commander.readiness(STILL, now))
    silent = str(commander.readiness(STILL, now + 1.0))
    assert silent.startswith("no good command for 1.01 s; accepted: 0.2 (command: position is 9 m in z; ")


def test_silence_ends_it_after_the_time_out_and_a_command_stands_until_then() -> None:
    source = Said()
    commander = Commander(source, VEHICLE, SETTINGS)
    now = heard(commander, source, 100.0, 101.0, said("ctbr")) - 0.01
    assert not commander.step(Sensed(STILL), now, 0.0)  # it has not taken over
    assert commander.decision is None
    commander.start(STILL, now)
    assert commander.step(Sensed(STILL), now, 0.0)
    commander.hear(STILL, now + 0.19)
    assert not commander.step(Sensed(STILL), now + 0.19, 0.0)
    assert commander.problem is None
    np.testing.assert_allclose(commander.decision.command, [12, 1, 2, -3])
    commander.hear(STILL, now + 0.21)
    commander.step(Sensed(STILL), now + 0.21, 0.0)
    assert commander.problem == "no good command for 0.21 s; accepted: 0.2"


@pytest.mark.parametrize("mode", GOOD)
def test_each_mode_enters_the_cascade_at_its_own_level(mode: str) -> None:
    """Of a vehicle that is what it is told to be already, the command is a hover, whatever the mode."""
    place = {"position": [0, 0, 1.0], "velocity": [0, 0, 0], "acceleration": [0, 0, 0], "attitude": [0, 0, 0]}
    rest = {"ctbr": {"body_rate": [0, 0, 0], "thrust": GRAVITY}, "attitude": {"attitude": [0, 0, 0], "thrust": GRAVITY}}
    content = rest.get(mode, {mode: place.get(mode)})
    source = Said()
    commander = Commander(source, VEHICLE, SETTINGS)
    source.waiting.append(encode(mode=mode, **content))
    commander.hear(STILL, 100.0)
    commander.start(STILL, 100.0)
    commander.step(Sensed(STILL), 100.0, 0.0)
    assert commander.decision.mode == "ctbr"
    np.testing.assert_allclose(commander.decision.command, [GRAVITY, 0, 0, 0], atol=1e-6)


def test_a_yaw_rate_turns_the_heading_and_leads_the_vehicle_by_no_more_than_a_leash() -> None:
    command = parse_command(said("velocity", yaw_rate=1.0), 7.0)
    turned = heading(command, Heading(0.1, 100.0), STILL, 100.05)
    assert turned == pytest.approx(0.15)
    for _ in range(100):
        turned = heading(command, Heading(turned, 100.0), STILL, 100.05)
    assert turned == pytest.approx(LEASH)
    kept = parse_command(said("acceleration"), 7.0)
    assert heading(kept, Heading(0.7, 100.0), STILL, 100.05) == 0.7
    rates = parse_command(said("ctbr"), 7.0)  # afterwards the vehicle's own heading is held
    assert heading(rates, Heading(0.7, 100.0), STILL, 100.05) == 0
    tilted = parse_command(said("attitude"), 7.0)
    assert heading(tilted, Heading(0.7, 100.0), STILL, 100.05) == 3.0


# UDP and the command line


def test_datagrams_are_read_with_their_sender_and_malformed_ones_counted() -> None:
    with Loopback() as link:
        for message in (said(), b"{", said("velocity")):
            link.send(message)
        commands: list[Any] = []
        until(lambda: commands.extend(link.source.read(time.monotonic())) or len(commands) == 2)
        assert [command.mode for command in commands] == ["position", "velocity"]
        assert commands[0].sender == f"127.0.0.1:{link.sender.getsockname()[1]}"
        assert abs(time.monotonic() - commands[0].received) < 5
        assert link.refused == 1
        assert "command: not JSON" in str(link.problem)
        with pytest.raises(ValueError, match=f"command source udp:127.0.0.1:{link.port} cannot be bound"):
            open_commands(f"udp:{link.port}")


@pytest.mark.parametrize("text", ["", "udp:", "udp:0", "tcp:host:5000", "serial"])
def test_what_names_no_source_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match=r"--commands is .*; accepted: udp:PORT; .*ros2:/topic"):
        open_commands(text)


def test_check_shows_what_comes_from_a_commander(capsys: pytest.CaptureFixture) -> None:
    with Loopback() as free, Loopback() as other:
        port, poses = free.port, other.port
    done = threading.Event()

    def send() -> None:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            while not done.wait(0.01):
                sender.sendto(said("velocity", stamp=time.monotonic()), ("127.0.0.1", port))
                sender.sendto(b"{}", ("127.0.0.1", port))

    thread = threading.Thread(target=send)
    thread.start()
    try:
        with controller(recorded) as client:
            link: Any = client.link
            fly_command(Fly(vehicle="vis_r", link=link.name, pose=f"udp:{poses}", commands=f"udp:{port}", check=True))
    finally:
        done.set()
        thread.join()
    told = " ".join(capsys.readouterr().out.split())
    found = re.search(rf"(\d+) accepted, (\d+) refused, from udp:127.0.0.1:{port}", told)
    assert found is not None, told
    assert min(map(int, found.groups())) > 10


@pytest.mark.parametrize("name", ["excitation", "steps"])
def test_a_policy_and_a_commander_at_once_are_refused(name: str) -> None:
    with pytest.raises(ValueError, match=f"--commands is 'udp:9871', and POLICY '{name}'; accepted: one of them"):
        fly_command(Fly(policy=Path(name), commands="udp:9871", vehicle="vis_r"))


def test_steps_need_a_vehicle_and_room() -> None:
    with pytest.raises(ValueError, match="--vehicle is left out"):
        fly_command(Fly(policy=Path("steps")))
    small = FlightSettings(fence=Fence(low=(-1.0, -1.0, 0.2), high=(1.0, 1.0, 4.5)))
    with pytest.raises(ValueError, match=r"in x, which leaves 1\.4 m .* for steps: .* or smaller --steps.rate"):
        fly_command(Fly(policy=Path("steps"), vehicle="vis_r", flight=small))
