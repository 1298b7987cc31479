"""`e2efly fly` as a process beside a recorded controller: what comes from outside, and a terminal that goes away."""

import json
import os
import pty
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from mcap.reader import make_reader
from rosbags.highlevel import AnyReader

from e2efly.commands.fly import Fly, _chosen, _prepared, parse
from e2efly.commands.fly import run as fly_command
from e2efly.commands.terminal import Terminal as Console
from e2efly.flight.betaflight.codec import REPLY, MspFrame, encode
from e2efly.flight.betaflight.messages import Name
from e2efly.flight.settings import Fence, FlightSettings
from e2efly.logs.flight_log import read_log
from e2efly.policy.zoo import contents, policy_file
from e2efly.tasks.hover.goal import HoverRoute
from e2efly.vehicles.loading import vehicle_names
from tests.flight.test_msp_client import controller, recorded
from tests.waiting import free_port, until

FORGED = "\x1b[2K\rPOLICY: all is well"


class Terminal:
    """What a process writes to a terminal."""

    def __init__(self) -> None:
        self._ours, self.theirs = pty.openpty()
        self.text = b""
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def wait_for(self, found: Callable[[bytes], bool]) -> None:
        until(lambda: found(self.text), 60.0, lambda: self.text)

    def hang_up(self) -> None:
        os.close(self._ours)

    def _read(self) -> None:
        while True:
            try:
                self.text += os.read(self._ours, 4096)
            except OSError:
                return


@pytest.mark.whole
def test_hostile_datagrams_forge_no_line_and_a_hang_up_ends_it_with_a_closed_log(tmp_path: Path) -> None:
    port, terminal, log = free_port(udp=True), Terminal(), tmp_path / "flight.mcap"
    with controller(recorded) as client, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        command = [sys.executable, "-m", "e2efly", "fly", "--vehicle", "vis_r", "--link", client.link.name]  # type: ignore
        live = ("--live", f"mcap:{tmp_path / 'live.mcap'}", "--live", f"bag:{tmp_path / 'live.bag'}")
        process = subprocess.Popen(
            [*command, "--pose", f"udp:{port}", "--log", str(log), *live],
            stdout=terminal.theirs,
            stderr=terminal.theirs,
        )
        os.close(terminal.theirs)
        try:
            terminal.wait_for(lambda text: b"INIT:" in text)
            for content in ({FORGED: 1}, {"\ud800": 1}):
                sender.sendto(json.dumps(content).encode(), ("127.0.0.1", port))
            twice = json.dumps(FORGED)
            sender.sendto(f"{{{twice}: 1, {twice}: 2}}".encode(), ("127.0.0.1", port))
            before = len(terminal.text)
            terminal.wait_for(lambda text: text[before:].count(b"INIT:") >= 2)
            terminal.wait_for(lambda text: rb"\x1b[2K\rPOLICY" in text[before:])
            assert b"\x1b" not in terminal.text[before:]
            terminal.hang_up()
            process.send_signal(signal.SIGHUP)
            assert process.wait(30) == 0
        finally:
            process.kill()
            process.wait()
    read = read_log(log)
    assert read.cut_off == ""
    assert len(read["command"]) > 20
    with (tmp_path / "live.mcap").open("rb") as file:  # what was published live, by processes that have ended too
        topics = [channel.topic for _, channel, _ in make_reader(file).iter_messages()]
    assert abs(topics.count("/command") - len(read["command"])) <= 0.01 * len(read["command"])
    with AnyReader([tmp_path / "live.bag"]) as reader:
        assert reader.topics["/command"].msgcount > 20


def test_a_craft_s_name_is_neither_markup_nor_an_escape_sequence(capsys: pytest.CaptureFixture) -> None:
    def named(code: int) -> bytes:
        return encode(MspFrame(code, f"[/]{FORGED}".encode(), REPLY)) if code == Name.CODE else recorded(code)

    with controller(named) as client:
        pose = f"udp:{free_port(udp=True)}"
        fly_command(Fly(vehicle="vis_r", link=client.link.name, pose=pose, check=True))  # type: ignore
    said = capsys.readouterr().out
    assert "\x1b" not in said
    assert "[/]" in said
    assert "none has come" in said and "not compared: no poses" in said and "estimated from the poses" not in said


def test_the_policy_of_the_goal_s_options_is_looked_for_in_no_device(tmp_path: Path) -> None:
    """A pipe that nobody writes to is read for ever, as a serial port is."""
    os.mkfifo(tmp_path / "port")
    options = parse(["--link", str(tmp_path / "port"), "hover", "--goal.target", "0", "0", "2"])
    assert isinstance(options.goal, HoverRoute)


def test_a_race_that_is_told_a_speed_is_flown_by_the_policy_that_obeys_it(capsys: pytest.CaptureFixture) -> None:
    """Of the zoo's policies; and the speed is said. A speed outside of the training is refused by name."""
    wide = ["--flight.fence.low", "-6", "-6", "0.2", "--flight.fence.high", "9", "9", "4.5"]
    given = ["race", "--goal.track", "room_6", *wide, "--goal.speed"]
    plan = _prepared(parse([*given, "4"]), Console())
    assert plan.policy == policy_file("race_speed")
    said = " ".join(capsys.readouterr().out.split())
    assert "vis_r/race_speed flies in place of vis_r/race" in said
    assert "It is told to fly at 4 m/s (goal.speed)." in said
    with pytest.raises(ValueError, match="goal: speed is 20 m/s; trained for 2 to 12 m/s"):
        _prepared(parse([*given, "20"]), Console())
    alone = parse(["race_speed", *wide])
    assert _prepared(alone, Console()).policy == policy_file("race_speed")
    assert "It is told to fly at 3 m/s (goal.speed)." in " ".join(capsys.readouterr().out.split())
    for vehicle in [name for name, tasks in contents().items() if name in vehicle_names() and "race" in tasks]:
        told = parse(["race", "--vehicle", vehicle, "--goal.speed", "4"])
        assert _chosen(told, Console())[0] == policy_file(f"{vehicle}/race_speed")
    copied = replace(parse(["race", "--goal.speed", "4"]), policy=policy_file("race_any"))
    assert _chosen(copied, Console())[0] == policy_file("race_speed")


def test_a_vehicle_with_six_rotors_is_refused_before_anything_is_opened() -> None:
    with pytest.raises(ValueError, match="vehicle 'hexa' has 6 rotors; accepted by fly: four level rotors"):
        _prepared(parse(["--vehicle", "hexa"]), Console())


def test_each_image_has_an_option_of_its_own() -> None:
    assert parse(["avoid", "--image", "a=shm:x", "--image", "b=shm:y"]).image == ("a=shm:x", "b=shm:y")


def test_a_filter_is_refused_before_anything_is_opened_in_a_fence_too_small_to_stop_in() -> None:
    fence = Fence(low=(-1.0, -3.0, 0.2), high=(1.0, 3.0, 4.5))
    options = Fly(vehicle="vis_r", guard="filter", link="/dev/none", flight=FlightSettings(fence=fence))
    with pytest.raises(ValueError, match=r"guard 'filter': flight.fence.speed is 6 m/s.* 2 m long in x; accepted"):
        fly_command(options)


@pytest.mark.parametrize(
    ("known", "told"),
    [
        ({"solids": ((1.0, -1.0, 0.0, 2.0, 1.0, 2.0),)}, r"flight.fence.solids is \(\(1.0, "),
        ({"scene": "room.toml"}, "flight.fence.scene is 'room.toml'"),
    ],
)
def test_solids_without_the_filter_that_knows_them_are_refused(known: Any, told: str) -> None:
    flight = FlightSettings(fence=Fence(**known))
    with pytest.raises(ValueError, match=told + r".* and --guard is 'switch'; accepted: with --guard filter"):
        fly_command(Fly(vehicle="vis_r", link="/dev/none", flight=flight))


def test_a_hover_controller_that_there_is_not_is_refused_before_anything_is_opened() -> None:
    with pytest.raises(ValueError, match=r"unknown hover controller 'pdi'; did you mean 'pid'\?"):
        fly_command(Fly(vehicle="vis_r", hover="pdi", link="/dev/none"))


def test_a_hover_controller_that_needs_more_than_the_flight_controller_tells_is_refused_by_name() -> None:
    with controller(recorded) as client, pytest.raises(ValueError, match=r"--hover is 'indi', which needs the speeds"):
        pose = f"udp:{free_port(udp=True)}"
        fly_command(Fly(vehicle="vis_r", hover="indi", link=client.link.name, pose=pose, check=True))  # type: ignore
