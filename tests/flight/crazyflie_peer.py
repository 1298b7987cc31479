"""A Crazyflie of ours that speaks CRTP as the firmware of 2026.08 documents it, over the rigid body, in virtual time.

Packets, tables of contents, log blocks, the supervisor's states and time-outs, the high-level commander's landing, and
a mixer that has no airmode are written here, from the firmware's sources, and share nothing with the bridge. They
prove format, order, signs and time-outs as read, not the firmware. How well its estimator goes on without poses is
assumed.
"""

import struct
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from e2efly.flight.bridge import Bridge
from e2efly.flight.crazyflie.crazyflie_autopilot import Crazyflie
from e2efly.flight.crazyflie.crazyflie_watchdog import TIMEOUT_S, CommanderLander
from e2efly.flight.crazyflie.words import TypedWish
from e2efly.flight.landing_plan import landing_plan
from e2efly.flight.pilot.flight_state import Mission
from e2efly.flight.pilot.hovering import HoverController
from e2efly.flight.settings import FlightSettings
from e2efly.vehicles.vehicle import Vehicle
from tests.faults.virtual_watchdog import VirtualWatchdog
from tests.flight.peer_rig import STEP_S, FlownPeer

UINT8, UINT16, FLOAT = (0x08, "B"), (0x09, "H"), (0x06, "f")
PARAMETERS: dict[str, tuple[tuple[int, str], float]] = {
    "flightmode.stabModeRoll": (UINT8, 1), "stabilizer.estimator": (UINT8, 2), "stabilizer.controller": (UINT8, 1),
    "stabilizer.stop": (UINT8, 0), "supervisor.prefltTimeout": (UINT16, 30000),
    "supervisor.landedTimeout": (UINT16, 3000), "supervisor.tmblChckEn": (UINT8, 1),
    "locSrv.extPosStdDev": (FLOAT, 0.01), "locSrv.extQuatStdDev": (FLOAT, 0.0045),
}  # fmt: skip
"""Type and value, in the order of the table."""
LOG_NAMES = (
    "pm.vbat", "supervisor.info", "stateEstimate.roll", *(f"stateEstimate.q{axis}" for axis in "xyzw"),
    *(f"{sensor}.{axis}" for sensor in ("acc", "gyro") for axis in "xyz"),
)  # fmt: skip
LOG_KINDS = {name: (2, "H") if name == "supervisor.info" else (7, "f") for name in LOG_NAMES}
LEVEL_S, OFF_S, FLYING_S = 0.5, 2.0, 2.0
TILTED_S, OVER_S = 1.0, 0.1
POSES_S, BIAS = 0.1, 0.1
"""After this time without a pose, s, its estimator goes on by its accelerometer, in error by so much, m/s^2."""
FASTEST, STEEPEST = 1.1, np.radians(20.0)
"""Limits of its position control, m/s and rad."""


@dataclass(frozen=True)
class Landing:
    """A landing of the high-level commander."""

    begun: float
    seconds: float
    start: np.ndarray
    """Where it began, as estimated, m."""
    descent: float

    def target(self, now: float) -> np.ndarray:
        """Where it should be: a polynomial of degree 7 that begins and ends at rest."""
        s = min(max((now - self.begun) / self.seconds, 0.0), 1.0)
        share = s**4 * (35 - 84 * s + 70 * s**2 - 20 * s**3)
        return self.start - np.array([0.0, 0.0, share * self.descent])


@dataclass
class Block:
    """A log block."""

    names: list[str]
    period: float = 0.0
    due: float = field(default=np.inf)


class CrazyflieRig(FlownPeer):
    """A Crazyflie in its world, with a pilot who types, and poses: what `Session` flies."""

    def __init__(
        self,
        vehicle: Vehicle,
        *,
        latency: float = 0.0,
        seed: int = 0,
        protocol: int = 12,
        needs_arming: bool = False,
        values: dict[str, float] | None = None,
        watched: bool = False,
    ) -> None:
        super().__init__(vehicle, latency, seed)
        self.protocol, self.needs_arming = protocol, needs_arming
        self.values = {name: value for name, (_, value) in PARAMETERS.items()} | (values or {})
        self.volts = 3.95
        self.supervisor = "ready"
        """Its state: passed, ready, flying, level, landed, locked or crashed."""
        self.pose_seen: tuple[float, ...] | None = None
        self.poses_seen = 0
        self._rates, self._thrust, self._at = np.zeros(3), 0.0, -np.inf
        self._turned = self._since = self._tilted = -np.inf
        self._blocks: dict[int, Block] = {}
        self._rest = b""
        if needs_arming:
            self.supervisor = "passed"
        self.dog = VirtualWatchdog(self.now, self.wire, CommanderLander(), TIMEOUT_S) if watched else None
        """The bridge's link goes through it."""
        self._landing: Landing | None = None
        self._streamed = False  # set-points have priority over the high-level commander
        self._posed, self._bias = 0.0, BIAS * self._noise.normal(size=3)
        self._error, self._slip = np.zeros(3), np.zeros(3)  # of the estimated position and velocity

    def wish(self) -> TypedWish | None:
        """What the pilot has typed."""
        return TypedWish(self.hand.armed, Mission(self.hand.mission)) if self.heard else None

    def autopilot(
        self, settings: FlightSettings, hover: HoverController | None = None, *, aids: bool = False
    ) -> Crazyflie:
        del hover, aids
        link = self.wire if self.dog is None else self.dog
        return Crazyflie.connect(link, self.world.vehicle, settings, self.wish, 1.0, self)

    def command(self, rates: np.ndarray, thrust: float) -> None:
        """A set-point: body rates, rad/s, FLU, and thrust, 0 to 1."""
        self._rates, self._thrust, self._at = rates, thrust, self.time
        self._streamed, self._landing = True, None  # any set-point ends what the high-level commander does

    def plan(self, bridge: Bridge) -> None:
        if self.dog is not None:
            self.dog.plan(landing_plan(bridge))

    def stop_watchdog(self) -> None:
        assert self.dog is not None
        self.dog.stopped = True

    # -- packets -------------------------------------------------------------------------------------------------------

    def hear(self) -> None:
        if self.dog is not None:
            self.dog.step()
        data = self._rest + self.wire.arrived()
        while data and len(data) > data[0]:
            packet, data = data[1 : 1 + data[0]], data[1 + data[0] :]
            if packet[0] & 0xF3 != 0xF3:
                assert packet[0] & 0x0C == 0x0C and len(packet) <= 31
                for answer in self._answers(packet[0] >> 4, packet[0] & 3, packet[1:]):
                    self.answer(packet[0], answer)
        self._rest = data

    def answer(self, header: int, data: bytes) -> None:
        assert len(data) <= 30
        self.wire.answer(bytes([1 + len(data), header]) + data)

    def _answers(self, port: int, channel: int, data: bytes) -> Iterator[bytes]:
        table = {2: list(PARAMETERS), 5: list(LOG_NAMES)}.get(port, [])
        match port, channel:
            case (2 | 5, 0) if data[0] == 3:
                yield struct.pack("<BHI", 3, len(table), 0x1234 + port)
            case (2 | 5, 0) if data[0] == 2:
                (number,) = struct.unpack("<H", data[1:])
                name = table[number]
                kind = PARAMETERS[name][0][0] if port == 2 else LOG_KINDS[name][0]
                yield data + bytes([kind]) + name.replace(".", "\0").encode() + b"\0"
            case (2, 1):
                name = table[struct.unpack("<H", data)[0]]
                yield data + b"\0" + struct.pack("<" + PARAMETERS[name][0][1], self._typed(name))
            case (5, 1):
                yield data[:2].ljust(2, b"\0") + bytes([self._logging(data)])
            case (7, 0) if data[0] == 11:
                p, q, r, thrust, rate = struct.unpack("<fffHB", data[1:])
                assert rate == 1
                self.command(np.radians([p, -q, r]), thrust / 65535)
            case (7, 1) if data[0] == 0:
                struct.unpack("<I", data[1:])
                self._streamed = False
            case (8, 0) if data[0] == 10:
                group, descent, relative, _, own_yaw, speed = struct.unpack("<Bf?f?f", data[1:])
                assert group == 0 and relative and own_yaw and speed > 0
                yield data[:3] + bytes([self._land(descent, descent / speed)])
            case (6, 1) if data[0] == 8:
                self.pose_seen = struct.unpack("<7f", data[1:])
                self.poses_seen += 1
                self._posed, self._error, self._slip = self.time, np.zeros(3), np.zeros(3)
            case (9, 1) if data[0] == 1 and self.protocol >= 12:
                self._arm(bool(data[1]))
            case (13, 0) if data[0] == 1 and self.protocol < 12:
                self._arm(bool(data[1]))
            case (13, 1):
                yield data[:1] + (struct.pack("<I", self.protocol), b"2026.08", b"Crazyflie 2.1")[data[0]]
            case (15, 0):
                yield data
            case _:
                raise AssertionError(f"unexpected packet {port}:{channel} {data.hex()}")

    def _typed(self, name: str) -> float:
        value = self.values[name]
        return value if PARAMETERS[name][0] == FLOAT else int(value)

    def _logging(self, data: bytes) -> int:
        if data[0] == 5:
            self._blocks.clear()
        elif data[0] == 6:
            if data[1] in self._blocks:
                return 17
            entries = [struct.unpack("<BH", data[i : i + 3]) for i in range(2, len(data), 3)]
            names = [LOG_NAMES[number] for _, number in entries]
            assert [LOG_KINDS[name][0] for name in names] == [kind for kind, _ in entries]
            if sum(struct.calcsize(LOG_KINDS[name][1]) for name in names) > 26:
                return 7
            self._blocks[data[1]] = Block(names)
        elif data[0] == 3:
            self._blocks[data[1]].period, self._blocks[data[1]].due = data[2] / 100, self.time
        return 0

    # -- supervisor and mixer ------------------------------------------------------------------------------------------

    def _arm(self, arm: bool) -> None:
        if arm and self.supervisor == "passed":
            self._to("ready")
        elif not arm and self.needs_arming and self.supervisor in ("ready", "flying", "level", "landed"):
            self._to("passed")

    def _to(self, state: str) -> None:
        self.supervisor, self._since = state, self.time
        self.log.append(state)

    def _land(self, descent: float, seconds: float) -> int:
        """A landing from here. Returns the firmware's answer."""
        if self._landing is not None:
            return 1
        self._landing = Landing(self.time, seconds, self._estimated()[0], descent)
        self.log.append("failsafe: landing")
        return 0

    def _estimated(self) -> tuple[np.ndarray, np.ndarray]:
        """Position and velocity of its estimator, which may have no poses. The complementary one knows only heights."""
        known = np.array([0.0, 0.0, 1.0]) if self.values["stabilizer.estimator"] == 1 else np.ones(3)
        return known * (self.state.position + self._error), known * (self.state.velocity + self._slip)

    def _high_level(self) -> None:
        """The set-points of the high-level commander, where others do not have priority."""
        if self.time - self._posed > POSES_S and self.values["stabilizer.estimator"] != 1:
            self._slip = self._slip + STEP_S * self._bias
            self._error = self._error + STEP_S * self._slip
        if self._landing is not None and self.time > self._landing.begun + self._landing.seconds:
            self._landing = None
        if self._streamed:
            return
        self._at, self._rates, self._thrust = self.time, np.zeros(3), 0.0  # without a landing: motors off
        if self._landing is None:
            return
        position, velocity = self._estimated()
        wanted = np.clip(2.0 * (self._landing.target(self.time) - position), -FASTEST, FASTEST)
        push = 3.0 * (wanted - velocity)
        tilt = np.hypot(*push[:2]) / 9.81 / np.tan(STEEPEST)
        push[:2] /= max(tilt, 1.0)
        push[2] = max(push[2] + 9.81, 1.0)
        w, x, y, z = np.asarray(self.state.quaternion)
        rotation = np.array([
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ])  # fmt: skip
        self._rates = 6.0 * rotation.T @ np.cross(rotation[:, 2], push / np.linalg.norm(push)) * [1, 1, 0]
        force = float(self.world.vehicle.mass) * float(push @ rotation[:, 2])
        self._thrust = min(max(force / (4 * self.thrust(self.world.full_speed)), 0.001), 1.0)

    @property
    def _allowed(self) -> bool:
        return self.supervisor in ("ready", "flying", "level", "landed")

    def _supervise(self) -> None:
        age, now = self.time - self._at, self.time
        flying = now - self._turned < FLYING_S
        up = float(self.force[2]) / 9.81
        self._tilted = np.inf if up >= 0.5 else min(self._tilted, now)
        tumbled = now - self._tilted > (OVER_S if up < -0.2 else TILTED_S) and self.values["supervisor.tmblChckEn"] == 1
        if self.supervisor in ("flying", "level") and age > OFF_S:
            self._to("locked")
        elif self.supervisor in ("flying", "level") and tumbled:
            self._to("crashed" if self.supervisor == "flying" else "locked")
        elif self.supervisor == "flying" and age > LEVEL_S:
            self.log.append("failsafe: set-points")
            self._to("level")
        elif self.supervisor == "level" and age <= LEVEL_S:
            self._to("flying")
        elif self.supervisor == "flying" and not flying:
            self._to("landed")
        elif self.supervisor in ("ready", "landed") and flying:
            self._to("flying")
        elif self.supervisor == "ready" and self.needs_arming:
            if now - self._since > self.values["supervisor.prefltTimeout"] / 1000:
                self._to("passed")
        elif self.supervisor == "landed" and now - self._since > self.values["supervisor.landedTimeout"] / 1000:
            self._to("passed" if self.needs_arming else "ready")

    def outputs(self) -> np.ndarray:
        """The firmware's PID: thrust, with torques that a motor without more thrust cannot follow."""
        self._high_level()
        self._supervise()
        if not self._allowed or self._thrust == 0 or self.values["stabilizer.stop"]:
            return np.zeros(4)
        rates = self.level(0.0)[1] if self.supervisor == "level" else self._rates
        full = self.thrust(self.world.full_speed)
        thrusts = full * self._thrust + self.torques(rates)
        thrusts = np.maximum(thrusts - max(float(thrusts.max()) - full, 0.0), 0.0)
        self._turned = self.time
        return self.turned(thrusts)

    # -- telemetry -----------------------------------------------------------------------------------------------------

    def _told(self, name: str) -> float:
        s = self.state
        group, axis = name.split(".")
        if group == "acc":
            return float(self.force["xyz".index(axis)]) / 9.80665
        if group == "gyro":
            return float(np.degrees(s.body_rate["xyz".index(axis)]))
        if axis.startswith("q"):
            return float(s.quaternion["wxyz".index(axis[1])])
        if name == "supervisor.info":
            bits = (
                self.supervisor == "passed", self._allowed, not self.needs_arming, self._allowed,
                self.supervisor in ("flying", "level"), False, self.supervisor == "locked",
                self.supervisor == "crashed",
            )  # fmt: skip
            return sum(bit << i for i, bit in enumerate(bits))
        return self.volts

    def tell(self) -> None:
        for number, block in self._blocks.items():
            if self.time >= block.due:
                block.due = self.time + block.period - STEP_S / 2
                values = b"".join(struct.pack("<" + LOG_KINDS[name][1], self._value(name)) for name in block.names)
                self.answer(0x5E, bytes([number]) + round(self.time * 1e3).to_bytes(3, "little") + values)

    def _value(self, name: str) -> float:
        value = self._told(name)
        return int(value) if LOG_KINDS[name][1] == "H" else value
