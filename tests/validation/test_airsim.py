"""AirSim: its RPC byte for byte beside the published client's, frames, lockstep, what is measured, and bad input."""

import dataclasses
import json
import socketserver
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import cosysairsim
import msgpack
import numpy as np
import pytest

import e2efly
from e2efly.commands.cli import run
from e2efly.control import Quat
from e2efly.validation.airsim import frames, protocol, vehicle_model
from e2efly.validation.airsim.lockstep import AirSimSession
from e2efly.validation.airsim.rpc import Rpc, RpcError
from e2efly.validation.plant import RigidState
from e2efly.validation.plants import find_plant
from e2efly.validation.plants.airsim import AirsimPlant
from e2efly.validation.plants.mujoco import MujocoPlant
from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.vehicle import Vehicle
from tests.validation.airsim_client import Tap, published
from tests.validation.airsim_server import FLIP, PERIOD, TURN, Server, World, settings
from tests.waiting import free_port

DRONE = "vis_r"
TILTED = RigidState(
    np.array([1.0, 2.0, 5.0]), np.array([0.5, -1.0, 0.3]), np.array([0.9, 0.1, 0.3, 0.3]), np.array([0.5, -0.3, 0.8])
)


@pytest.fixture
def server(vis_r: Vehicle) -> Iterator[Server]:
    with Server(World(vis_r, 1, settings())) as served:
        yield served


@pytest.fixture
def connect() -> Iterator[Callable[..., Rpc]]:
    """Makes connections of ours, and closes them."""
    made: list[Rpc] = []

    def connected(port: int, **options: float) -> Rpc:
        made.append(Rpc("127.0.0.1", port, **options))
        return made[-1]

    yield connected
    for rpc in made:
        rpc.close()


def flown(server: Server, vehicle: Vehicle) -> AirsimPlant:
    kind = find_plant(f"airsim:127.0.0.1:{server.port}")
    assert issubclass(kind, AirsimPlant)
    return kind(vehicle, "ctbr")


def their_kinematics(state: RigidState) -> cosysairsim.KinematicsState:
    """The published client's structure, filled by hand: NED and FRD."""
    q = state.quaternion
    matrix = FLIP @ rotation(q) @ TURN
    w, x, y, z = frames.attitude(q)
    np.testing.assert_allclose(rotation(np.array([w, x, y, z])), matrix, atol=1e-12)
    k = cosysairsim.KinematicsState()
    k.position = cosysairsim.Vector3r(*map(float, FLIP @ state.position))
    k.orientation = cosysairsim.Quaternionr(float(x), float(y), float(z), float(w))
    k.linear_velocity = cosysairsim.Vector3r(*map(float, FLIP @ state.velocity))
    k.angular_velocity = cosysairsim.Vector3r(*map(float, TURN @ state.body_rate))
    k.linear_acceleration, k.angular_acceleration = cosysairsim.Vector3r(), cosysairsim.Vector3r()
    return k


def rotation(q: np.ndarray) -> np.ndarray:
    w, x, y, z = q / np.linalg.norm(q)
    v = np.array([x, y, z])
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return (w * w - v @ v) * np.eye(3) + 2 * np.outer(v, v) + 2 * w * cross


def unit(*q: float) -> np.ndarray:
    return np.array(q) / np.linalg.norm(q)


@pytest.mark.parametrize("q", [unit(1, 0, 0, 0), unit(0.9, 0.1, 0.3, -0.3), unit(-0.2, 0.7, 0.1, 0.6)])
def test_frames_are_those_of_rotation_matrices(q: np.ndarray) -> None:
    np.testing.assert_allclose(rotation(frames.attitude(q)), FLIP @ rotation(q) @ TURN, atol=1e-12)
    np.testing.assert_allclose(rotation(frames.attitude(frames.attitude(q))), rotation(q), atol=1e-12)
    v = np.array([1.0, 2.0, 3.0])
    np.testing.assert_allclose(frames.world(v), FLIP @ v)
    np.testing.assert_allclose(frames.body(v), TURN @ v)
    assert frames.world(np.array([1.0, 0.0, 0.0])).tolist() == [0, 1, 0]  # east is AirSim's y


def test_every_request_is_byte_for_byte_that_of_the_published_client(server: Server, connect: Any) -> None:
    """All methods that we use; the published client negates pitch and yaw rate of FLU by itself, as we must."""
    theirs, ours = Tap(server.port), Tap(server.port)
    state = dataclasses.replace(TILTED, position=np.array([1.0, 2.0, 5.0]))
    with published(theirs.port) as client:
        client.ping()
        client.getServerVersion()
        client.getSettingsString()
        client.simPause(False)
        client.reset()
        client.enableApiControl(True, DRONE)
        client.isApiControlEnabled(DRONE)
        client.armDisarm(True, DRONE)
        client.simPause(True)
        client.simIsPause()
        client.simSetKinematics(their_kinematics(state), True, DRONE)
        client.simGetGroundTruthKinematics(DRONE)
        client.getMultirotorState(DRONE)
        gains = [cosysairsim.PIDGains(kp, 0.0, 0.0) for kp in (0.03, 0.04, 0.08)]
        client.setAngleRateControllerGains(cosysairsim.AngleRateControllerGains(*gains), DRONE)
        future = client.moveByAngleRatesThrottleAsync(0.1, -0.2, 0.3, 0.5, 1.0, DRONE)
        client.cancelLastTask(DRONE)
        client.cancelLastTask(DRONE)
        future.join()
        client.simContinueForTime(0.05)

    session = AirSimSession(connect(ours.port), DRONE)
    session.place(state)
    session.state()
    session.set_gains(np.array([0.03, 0.04, 0.08]))
    session.command(np.array([0.1, -0.2, 0.3]), 0.5)
    session.rpc.call("simContinueForTime", 0.05)
    wire, golden = ours.requests(), theirs.requests()
    session.close()
    assert set(wire) == set(golden) == set(protocol.METHODS)
    for method, sent in golden.items():
        assert wire[method] == sent, method
    assert golden["moveByAngleRatesThrottle"] == bytes.fromhex(
        "b86d6f76654279416e676c655261746573546872 6f74746c65"
        "96cb3fb999999999999acb3fc999999999999acbbfd3333333333333cb3fe0000000000000cb3ff0000000000000a57669735f72"
    )


def test_the_same_calls_by_both_clients_give_the_same_states(vis_r: Vehicle, connect: Any) -> None:
    command, throttle, stretches = (0.5, -1.0, 0.4), 0.4, (0.05, 0.1, 0.033)
    ends = []
    for ours in (False, True):
        with Server(World(vis_r, 4, settings(), seed=3)) as server, published(server.port) as client:
            client.reset()
            client.enableApiControl(True)
            client.armDisarm(True)
            client.simPause(True)
            if ours:
                rpc = connect(server.port)
                rpc.call("simSetKinematics", protocol.kinematics(TILTED), True, "")
                p, q, r = frames.body(np.array(command)).tolist()
                number = rpc.send("moveByAngleRatesThrottle", p, q, r, throttle, 1.0, "")
                while not rpc.arrived(number, 0.01):
                    rpc.call("cancelLastTask", "")
                for seconds in stretches:
                    rpc.call("simContinueForTime", seconds)
                ends.append(protocol.rigid_state(rpc.call("simGetGroundTruthKinematics", "")))
                rpc.close()
            else:
                client.simSetKinematics(their_kinematics(TILTED), True)
                future = client.moveByAngleRatesThrottleAsync(*command, throttle, 1.0)
                client.simIsPause()
                client.cancelLastTask()
                future.join()
                for seconds in stretches:
                    client.simContinueForTime(seconds)
                k: Any = client.simGetGroundTruthKinematics()
                position, rate = (FLIP, k.position), (TURN, k.angular_velocity)
                ends.append([m @ v.to_numpy_array() for m, v in (position, rate)])
    (position, rate), flown = ends
    np.testing.assert_allclose(flown.position, position, atol=1e-6)
    np.testing.assert_allclose(flown.body_rate, rate, atol=1e-6)
    assert np.linalg.norm(flown.position - TILTED.position) > 0.1


def test_the_server_refuses_what_rpclib_refuses(server: Server, connect: Any) -> None:
    rpc = connect(server.port)
    with pytest.raises(RpcError, match=r"simPause failed: .*invalid number of arguments\. Expected: 1, got: 2"):
        rpc.call("simPause", True, "")
    with pytest.raises(RpcError, match="could not find function 'fly'"):
        rpc.call("fly")
    rpc.close()


def test_lockstep_keeps_time_though_the_simulator_ends_early_or_late(server: Server, connect: Any) -> None:
    session = AirSimSession(connect(server.port))
    assert session.step == pytest.approx(PERIOD, abs=1e-6)
    began, worst = session._now(), 0.0
    for k in range(60):
        session.advance(1 / 30)
        worst = max(worst, abs((session._now() - began) / 1e9 - (k + 1) / 30))
    assert worst <= PERIOD / 2 + 1e-6
    before = session.state().position
    assert np.array_equal(session.state().position, before)  # it stands still in between
    session.close()
    assert not server.world.paused
    assert not server.world.control


def test_a_command_acts_from_the_first_physics_step_on(server: Server, connect: Any) -> None:
    """The method blocks in a pause: a client that only sent it and let time pass would race it."""
    session = AirSimSession(connect(server.port))
    for k in range(20):
        rates = np.array([0.1 * k, 0.2, -0.3])
        session.command(rates, 0.3)
        np.testing.assert_allclose(server.world.goal, [*rates, 0.3])
    session.close()


def test_a_flight_is_that_of_mujoco_behind_it(server: Server, vis_r: Vehicle) -> None:
    plant, mujoco = flown(server, vis_r), MujocoPlant(vis_r)
    start = dataclasses.replace(TILTED, quaternion=unit(0.95, 0.1, 0.2, 0.2))
    ends, rng = [], np.random.default_rng(0)
    commands = rng.uniform([7, -2, -2, -1], [13, 2, 2, 1], (15, 4))
    for each in (plant, mujoco):
        each.reset(start)
        np.testing.assert_allclose(each.state.velocity, start.velocity, atol=1e-6)
        for command in commands:
            each.step(command, 1 / 30)
        ends.append(each.state)
    there, here = ends
    assert np.linalg.norm(here.position - start.position) > 0.3
    np.testing.assert_allclose(there.position, here.position, atol=0.02)
    np.testing.assert_allclose(there.velocity, here.velocity, atol=0.08)
    np.testing.assert_allclose(there.body_rate, here.body_rate, atol=0.1)
    assert plant.grounded
    plant.reset(RigidState(np.array([0, 0, 3.0]), np.zeros(3), np.eye(4)[0], np.zeros(3)))
    plant.step(np.array([GRAVITY, 0, 0, 0]), 0.5)
    np.testing.assert_allclose(plant.state.position, [0, 0, 3.0], atol=5e-3)
    plant.close()


def test_what_is_measured_is_what_the_vehicle_has(server: Server, vis_r: Vehicle) -> None:
    plant = flown(server, vis_r)
    measured = plant.model
    assert measured.thrust == pytest.approx(4 * vis_r.thrust_range[1] / vis_r.mass, rel=0.01)
    np.testing.assert_allclose(measured.turn, server.world._authority, rtol=0.03)
    np.testing.assert_allclose(
        measured.drag, 5 * (vis_r.drag_linear + 5 * vis_r.drag_quadratic) / vis_r.mass, rtol=0.05
    )
    np.testing.assert_allclose(measured.gains(vis_r.rate_gain) * server.world._authority, vis_r.rate_gain, rtol=0.03)
    assert vehicle_model.differences(measured, vis_r) == []
    plant.close()
    other = dataclasses.replace(vis_r, mass=vis_r.mass * 1.2, motor_time_constant=2 * vis_r.motor_time_constant)
    told = " ".join(vehicle_model.differences(measured, other))
    assert "full thrust over mass of 27.3 m/s^2; vis_r has 22.8" in told
    assert "lag of thrust" in told
    assert "drag over mass at 5 m/s along z" in told
    assert "angular acceleration" not in told


def test_a_race_is_flown_there_as_in_training(server: Server) -> None:
    found = e2efly.validate("race", f"airsim:127.0.0.1:{server.port}", episodes=1)
    assert found.passed
    assert found.plant.name == "airsim"
    assert found.differences == ()
    assert "airsim" in found.as_json()["criteria"]["race"]


def answering(reply: Callable[[list[Any]], bytes]) -> socketserver.ThreadingTCPServer:
    """A server that answers each request with these bytes."""

    class Handler(socketserver.BaseRequestHandler):
        def handle(self) -> None:
            unpacker = msgpack.Unpacker()
            while data := self.request.recv(1 << 16):
                unpacker.feed(data)
                for message in unpacker:
                    if (answer := reply(message)) == b"close":
                        return
                    self.request.sendall(answer)

    served = socketserver.ThreadingTCPServer(("127.0.0.1", 0), Handler)
    served.daemon_threads = True
    threading.Thread(target=served.serve_forever, kwargs={"poll_interval": 0.02}, daemon=True).start()
    return served


@pytest.mark.parametrize(
    ("reply", "told"),
    [
        (lambda m: b"\xc1\xc1", "no MessagePack"),
        (lambda m: b"HTTP/1.1 400 Bad Request\r\n", "accepted: \\[1, id, error, result\\]"),
        (lambda m: msgpack.packb([1, m[1] + 7, None, True]), "answers request 7; accepted: those that are open"),
        (lambda m: msgpack.packb([1, m[1], "out of order", None]), "ping failed: out of order"),
        (lambda m: b"close", "closed the connection, asked for ping"),
        (lambda m: b"", "no answer to ping within 0.2 s"),
        (lambda m: msgpack.packb([1, m[1], None, 7]), "getServerVersion is 7; accepted: 1 \\(AirSim 1.8.1\\)"),
    ],
)
def test_a_server_that_talks_nonsense_is_named(reply: Callable[[list[Any]], bytes], told: str, connect: Any) -> None:
    served = answering(reply)
    port = served.server_address[1]
    with pytest.raises((OSError, ValueError), match=f"airsim:127.0.0.1:{port}: .*{told}"):
        AirSimSession(connect(port, timeout=0.2))
    served.shutdown()
    served.server_close()


def test_nobody_there_is_named(capsys: pytest.CaptureFixture[str]) -> None:
    port = free_port()
    assert run(["validate", "hover", "--plant", f"airsim:127.0.0.1:{port}", "--episodes", "1"]) == 2
    assert f"airsim:127.0.0.1:{port}: nobody answers" in " ".join(capsys.readouterr().err.split())


@pytest.mark.parametrize("address", ["h:0", "h:x", "h:99999", "h:1:v:w", "h:\N{SUPERSCRIPT TWO}"])
def test_an_address_that_is_none_is_named(address: str) -> None:
    with pytest.raises(ValueError, match=f"--plant is airsim:{address}; accepted: airsim:HOST"):
        find_plant(f"airsim:{address}")


def test_addresses() -> None:
    found = find_plant("airsim:example:7:drone")
    assert issubclass(found, AirsimPlant)
    assert (found.host, found.port, found.named) == ("example", 7, "drone")
    plain = find_plant("airsim")
    assert issubclass(plain, AirsimPlant)
    assert (plain.host, plain.port, plain.named) == ("127.0.0.1", 41451, "")


def test_a_clock_that_runs_in_a_pause_is_named(server: Server, connect: Any) -> None:
    server.world.now = lambda: int(1e9 * __import__("time").time())  # type: ignore[method-assign]
    with pytest.raises(RpcError, match="the clock runs in a pause; accepted: ClockType SteppableClock"):
        AirSimSession(connect(server.port))


def test_a_clock_that_stands_is_named(server: Server, connect: Any) -> None:
    server.world.go_on = lambda seconds: None  # type: ignore[method-assign]
    with pytest.raises(RpcError, match="the simulator's clock does not go on"):
        AirSimSession(connect(server.port))


def test_a_state_that_is_none_is_named(server: Server, connect: Any) -> None:
    session = AirSimSession(connect(server.port))
    truth = server.world.kinematics()
    for change, told in (({"position": {}}, "position.x_val is None"), ({"orientation": None}, "orientation.w_val")):
        server.world.kinematics = lambda change=change: {**truth, **change}  # type: ignore[method-assign]
        with pytest.raises(ValueError, match=f"simGetGroundTruthKinematics: KinematicsState.{told}"):
            session.state()
    session.close()


def test_rotor_thrusts_are_refused_before_anything_is_asked(vis_r: Vehicle) -> None:
    with pytest.raises(ValueError, match="plant 'airsim' takes no 'rotor_thrust' commands"):
        AirsimPlant(vis_r, "rotor_thrust")


def test_settings_for_a_vehicle_and_a_camera(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "settings.json"
    assert run(["airsim-settings", "vis_r", "--policy", "avoid", "--port", "41500", "--out", str(file)]) == 0
    told, content = capsys.readouterr().out, json.loads(file.read_text())
    assert content["ClockType"] == "SteppableClock"
    assert (content["ApiServerPort"], content["LocalHostIp"]) == (41500, "127.0.0.1")
    (camera,) = content["Vehicles"]["vis_r"]["Cameras"].values()
    from e2efly.policy.loader import load_policy
    from e2efly.policy.zoo import policy_file

    (image,) = load_policy(policy_file("avoid")).contract.images
    capture = camera["CaptureSettings"][0]
    assert capture["FOV_Degrees"] == pytest.approx(np.degrees(image.fov_rad[0]))
    assert camera["Pitch"] == pytest.approx(-np.degrees(image.pitch_rad))
    sees = 2 * np.arctan(np.tan(image.fov_rad[0] / 2) * capture["Height"] / capture["Width"])
    assert sees == pytest.approx(image.fov_rad[1], abs=0.03)
    for field in ("mass", "inertia", "thrust_map", "motor_time_constant", "drag_linear"):
        assert field in told
    assert run(["airsim-settings", "vis_r", "--port", "0", "--out", str(tmp_path / "none.json")]) == 2
    assert not (tmp_path / "none.json").exists()


def test_quaternions_that_are_not_unit_are_refused() -> None:
    answer = protocol.kinematics(TILTED)
    answer["orientation"]["w_val"] = 3.0
    with pytest.raises(ValueError, match=r"orientation is .*accepted: a unit quaternion"):
        protocol.rigid_state(answer)
    assert Quat.of(frames.attitude(TILTED.quaternion)).w == pytest.approx(
        Quat.of(frames.attitude(frames.attitude(frames.attitude(TILTED.quaternion)))).w
    )
