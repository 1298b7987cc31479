"""What differs between PX4 and ArduPilot: modes, parameters that matter to a flight, and what each means.

Facts as read in the documentation and sources of PX4 1.14 to 1.16 and ArduCopter 4.4 to 4.6 (docs/mavlink.md says which
are verified). A flight is OFFBOARD of PX4 and GUIDED_NOGPS of ArduCopter, with body rates and thrust.
"""

import struct
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from e2efly.flight.mavlink.copter_gains import NAMES, gain_rows
from e2efly.flight.row import Row
from e2efly.vehicles.vehicle import Vehicle

LAND_S = 0.5
"""The autopilot must notice within this time that commands have ended, s."""
NOT_TOLD = "not told"
Parameters = Mapping[str, float]


@dataclass(frozen=True)
class Needed:
    """What a flight needs of one parameter."""

    name: str
    good: Callable[[float], bool]
    needed: str
    """In words: what is needed, and why."""
    mend: str = ""
    """The value that corrects it. Empty: the owner has to choose."""
    meaning: Callable[[float], str] = lambda value: ""
    """What a value means."""
    optional: bool = False
    """Not every version has it."""

    def row(self, parameters: Parameters) -> Row:
        """The parameter as a row of the table."""
        lines = (f"param set {self.name} {self.mend}",) if self.mend else ()
        if self.name not in parameters:
            return Row(self.name, NOT_TOLD, self.needed, self.optional, lines, told=not self.optional)
        value = parameters[self.name]
        said = self.meaning(value)
        return Row(self.name, f"{value:g}" + (f": {said}" if said else ""), self.needed, self.good(value), lines)


@dataclass(frozen=True)
class MavlinkDialect:
    """One autopilot that speaks MAVLink."""

    name: str
    autopilot: int
    """Its number in HEARTBEAT."""
    mode: int
    """`custom_mode` of the mode in which it takes commands."""
    mode_name: str
    releases: tuple[tuple[int, int], ...]
    """Known major and minor versions."""
    needs: tuple[Needed, ...]
    integers_bytewise: bool
    """Whether the value of an integer parameter is sent as its own bytes, rather than as a float."""
    curve: str
    """Parameter of the curve from thrust to output: thrust = (1 - f) u + f u^2, u being the output."""
    sticks: tuple[str, str, str, str]
    """Parameters with the channels of roll, pitch, throttle and yaw."""
    reversed_name: str
    """Parameter that reverses channel {n} ..."""
    reversed_value: float
    """... and its value that does."""
    forward: int
    """1 where a pitch stick in front is above the centre of its channel, -1 where it is below."""
    ground_station: str
    """Parameter with the system id whose heartbeats count for the loss of the link. Empty: any system's do."""
    passes_poses: tuple[str, ...]
    """Parameters that make it take poses, if one of them is not 0."""
    fuses: Mapping[str, float]
    """Parameters, and their values, with which its estimator uses poses that it takes."""
    cells: str
    """Parameter with the number of the battery's cells. Empty: there is none."""
    tuned: tuple[str, ...] = ()
    """Parameters of its rate loop and mixer ..."""
    tuned_rows: Callable[[Vehicle, Parameters], tuple[Row, ...]] = lambda vehicle, told: ()
    """... and the rows that show them beside those of a vehicle file."""

    @property
    def parameters(self) -> tuple[str, ...]:
        """All parameters that are read."""
        others = (
            self.curve,
            *self.sticks,
            self.ground_station,
            *self.passes_poses,
            *self.fuses,
            self.cells,
            *self.tuned,
        )
        return tuple(dict.fromkeys((*(need.name for need in self.needs), *filter(None, others))))

    def poses_row(self, told: Parameters) -> Row:
        """What becomes of the poses, as a row of the table. Nothing of it forbids a flight."""
        taken = [f"{name} {told[name]:g}" for name in self.passes_poses if told.get(name)]
        if not taken:
            value = f"{', '.join(self.passes_poses)} 0: its estimator gets no poses, and its own landing drifts"
            return Row("poses", value, "any", True)
        unused = tuple(f"param set {name} {value:g}" for name, value in self.fuses.items() if told.get(name) != value)
        value = f"{', '.join(taken)}: they are passed on" + (", and its estimator does not use all" if unused else "")
        return Row("poses", value, "any", True, unused, told=not unused)

    def value(self, raw: bytes, kind: int) -> float:
        """The value of a parameter: 4 bytes, and its type as MAV_PARAM_TYPE."""
        if self.integers_bytewise and kind != 9:
            return float(int.from_bytes(raw, "little", signed=kind in (2, 4, 6)))
        return float(struct.unpack("<f", raw)[0])


def _among(*values: float) -> Callable[[float], bool]:
    return lambda value: value in values


def _named(names: Mapping[int, str]) -> Callable[[float], str]:
    return lambda value: names.get(int(value), "unknown")


_OFFBOARD_LOSS = {
    0: "Position mode, which waits for the pilot's sticks", 1: "Altitude mode, which waits for the pilot's sticks",
    2: "Manual, which waits for the pilot's sticks", 3: "Return, which needs a global position", 4: "Land",
    5: "Hold, which never lands", 6: "Terminate", 7: "Disarm: it falls",
}  # fmt: skip
_RECEIVER_LOSS = {
    0: "nothing", 1: "Hold, which never lands", 2: "Return, which needs a global position", 3: "Land",
    5: "Terminate", 6: "Disarm: it falls",
}  # fmt: skip
PX4 = MavlinkDialect(
    name="PX4",
    autopilot=12,
    mode=6 << 16,
    mode_name="OFFBOARD",
    releases=((1, 14), (1, 15), (1, 16)),
    needs=(
        Needed("COM_OF_LOSS_T", lambda s: 0 < s <= LAND_S, f"at most {LAND_S:g} s: for so long it holds the last "
               "command when this program dies", "0.3"),
        Needed("COM_OBL_RC_ACT", _among(4), "4, Land: what it does when commands end", "4", _named(_OFFBOARD_LOSS)),
        Needed("NAV_RCL_ACT", _among(3), "3, Land: what it does when the receiver is lost", "3",
               _named(_RECEIVER_LOSS)),
        Needed("COM_RCL_EXCEPT", lambda bits: not int(bits) & 4, "without bit 2 (4): or a lost receiver is ignored",
               "0"),
        Needed("COM_RC_IN_MODE", _among(0, 2, 3), "0: the pilot's receiver, whose switches decide", "0"),
        Needed("MAV_FWDEXTSP", _among(1), "1: or set-points are not used", "1"),
        Needed("MC_AIRMODE", _among(1, 2), "1 or 2: torque goes before thrust at any throttle", "1"),
        Needed("MC_BAT_SCALE_EN", _among(0), "0: the throttle map follows the battery itself", "0"),
        Needed("THR_MDL_FAC", lambda f: 0 <= f <= 1, "any from 0 to 1: its curve is inverted", "0"),
        Needed("COM_DISARM_LAND", lambda s: True, "any: it may disarm after a landing"),
        Needed("BAT1_N_CELLS", lambda cells: cells >= 1, "the number of cells, or the voltage of one is unknown"),
    ),
    integers_bytewise=True,
    curve="THR_MDL_FAC",
    sticks=("RC_MAP_ROLL", "RC_MAP_PITCH", "RC_MAP_THROTTLE", "RC_MAP_YAW"),
    reversed_name="RC{n}_REV",
    reversed_value=-1.0,
    forward=1,
    ground_station="",
    passes_poses=("EKF2_EV_CTRL",),
    fuses={},
    cells="BAT1_N_CELLS",
)  # fmt: skip
_GCS_LOSS = {
    0: "nothing: it hovers level until its battery is empty", 1: "return, which needs a position",
    2: "go on with a mission", 3: "return, which needs a position", 4: "return, which needs a position", 5: "Land",
    6: "return, which needs a position", 7: "Brake, which never lands",
}  # fmt: skip
_THROTTLE_LOSS = {
    0: "nothing", 1: "return, which needs a position", 2: "go on with a mission", 3: "Land",
    4: "return, which needs a position", 5: "return, which needs a position", 6: "return, which needs a position",
    7: "Brake, which never lands",
}  # fmt: skip
ARDUPILOT = MavlinkDialect(
    name="ArduCopter",
    autopilot=3,
    mode=20,
    mode_name="GUIDED_NOGPS",
    releases=((4, 4), (4, 5), (4, 6)),
    needs=(
        Needed("GUID_OPTIONS", lambda bits: int(bits) & 9 == 9, "with bits 0 and 3 (9): the transmitter arms it in "
               "this mode, and thrust is not a climb rate", "9"),
        Needed("RC_OPTIONS", lambda bits: True, "any: with bit 5 (32) it arms only with the throttle stick low. Lift "
               "it to the middle before the hover"),
        Needed("GUID_TIMEOUT", lambda s: 0 < s <= LAND_S, f"at most {LAND_S:g} s: for so long it holds the last "
               "command when this program dies; then it is level and keeps its height", "0.3"),
        Needed("FS_GCS_ENABLE", _among(5), "5, Land: what it does when this program's heartbeats end", "5",
               _named(_GCS_LOSS)),
        Needed("FS_GCS_TIMEOUT", lambda s: s <= 5, "at most 5 s: from the last heartbeat to the landing", "2",
               optional=True),
        Needed("FS_THR_ENABLE", _among(3), "3, Land: what it does when the receiver is lost", "3",
               _named(_THROTTLE_LOSS)),
        Needed("FS_OPTIONS", lambda bits: not int(bits) & 4, "without bit 2 (4): or a lost receiver is ignored",
               "0"),
        Needed("ATC_ANGLE_BOOST", _among(0), "0: or thrust grows with the tilt, and ends beyond 84 degrees", "0"),
        Needed("PILOT_THR_FILT", _among(0), "0: or thrust is filtered", "0"),
        Needed("MOT_THST_EXPO", lambda f: 0 <= f <= 1, "any from 0 to 1: its curve is inverted", "0.65"),
        Needed("MOT_BAT_VOLT_MAX", _among(0), "0: the throttle map follows the battery itself", "0"),
        *(Needed(f"ATC_ACCEL_{axis}_MAX", _among(0), "0: or body rates are reached slowly", "0") for axis in "RPY"),
        Needed("ATC_RATE_FF_ENAB", _among(1), "1: or body rates only turn the attitude that it holds", "1"),
    ),
    integers_bytewise=False,
    curve="MOT_THST_EXPO",
    sticks=("RCMAP_ROLL", "RCMAP_PITCH", "RCMAP_THROTTLE", "RCMAP_YAW"),
    reversed_name="RC{n}_REVERSED",
    reversed_value=1.0,
    forward=-1,
    ground_station="SYSID_MYGCS",
    passes_poses=("VISO_TYPE",),
    fuses=dict.fromkeys((f"EK3_SRC1_{what}" for what in ("POSXY", "VELXY", "POSZ", "VELZ", "YAW")), 6),
    cells="",
    tuned=NAMES,
    tuned_rows=gain_rows,
)  # fmt: skip
DIALECTS = (PX4, ARDUPILOT)


def dialect_of(number: int) -> MavlinkDialect:
    """The dialect of an autopilot by its number in HEARTBEAT.

    Raises:
        ValueError: it is none that is known.
    """
    found = next((dialect for dialect in DIALECTS if dialect.autopilot == number), None)
    if found is None:
        known = ", ".join(f"{dialect.autopilot} ({dialect.name})" for dialect in DIALECTS)
        raise ValueError(f"autopilot: HEARTBEAT tells number {number}; accepted: {known}")
    return found


def release_row(dialect: MavlinkDialect, version: tuple[int, int, int]) -> Row:
    """The version as a row of the table: one that nobody has read is refused by its name."""
    known = version[:2] in dialect.releases
    first, last = (".".join(map(str, release)) for release in (dialect.releases[0], dialect.releases[-1]))
    return Row("firmware", f"{dialect.name} {'.'.join(map(str, version))}", f"{dialect.name} {first} to {last}", known)
