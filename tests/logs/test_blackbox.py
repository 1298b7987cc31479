"""A blackbox laid into the log of its flight; the delay that setpoints show."""

from pathlib import Path

import numpy as np
import pytest

from e2efly.logs.blackbox import read_blackbox
from e2efly.logs.blackbox_merge import setpoint_delay, with_blackboxes
from e2efly.logs.readers import BLACKBOX, read_flights
from e2efly.logs.recording import Record, Stream

DATA = Path(__file__).parent.parent / "data" / "blackbox"


def motion(time: np.ndarray) -> np.ndarray:
    """Body rates, rad/s, (n, 3): lively from 4 s on."""
    parts = [np.sin(2 * np.pi * f * time + i) for i, f in enumerate((1.3, 2.1, 3.7))]
    return (
        np.stack([a + 0.5 * b for a, b in zip(parts, parts[1:] + parts[:1], strict=True)], -1)
        * (np.clip(time - 4, 0, 1)[:, None])
    )


def held(time: np.ndarray, at: np.ndarray, values: np.ndarray) -> np.ndarray:
    return values[np.maximum(np.searchsorted(at, time, side="right") - 1, 0)]


OWN = np.arange(0.0, 20.0, 0.000125)
SENT = np.arange(0.0, 22.0, 0.01)
ORDERS = np.random.default_rng(0).normal(size=(len(SENT), 4))


def true_time(own: np.ndarray) -> np.ndarray:
    """Of the blackbox's clock, which began later and runs 200 us a second faster."""
    return 1.2345 + own / 1.0002


def flight(*, gyro: bool = True) -> Record:
    time = np.arange(0.0, 22.0, 0.02)
    rates = motion(time) if gyro else motion(time[::-1] ** 1.3)
    return Record(Path("a.mcap"), {"body_rate": Stream(time, rates), "command": Stream(SENT, ORDERS)})


def box() -> Record:
    at = true_time(OWN)
    streams = {
        "body_rate": Stream(OWN, motion(at)),
        "motor": Stream(OWN, np.tile(np.sin(at)[:, None] ** 2, (1, 4))),
        "setpoint": Stream(OWN, held(at - 0.017, SENT, ORDERS[:, 1:])),
    }
    return Record(Path("b.bbl"), streams, kind=BLACKBOX)


def test_a_blackbox_is_laid_over_its_flight_to_half_a_millisecond() -> None:
    (found,) = with_blackboxes([flight(), box()])
    motor = found.streams["motor"]
    assert motor.rate == pytest.approx(1000, rel=0.01)
    assert np.allclose(motor.values[:, 0], np.sin(motor.time) ** 2, atol=5e-4)
    assert "b.bbl is laid over it" in found.notes[-1]


def test_a_blackbox_of_another_flight_stays_a_flight_of_its_own() -> None:
    found = with_blackboxes([flight(gyro=False), box(), box()])
    assert [r.path.name for r in found] == ["a.mcap", "b.bbl", "b.bbl"]


def test_setpoints_show_the_delay_of_the_commands() -> None:
    (found,) = with_blackboxes([flight(), box()])
    assert setpoint_delay(found) == pytest.approx(0.017, abs=1e-3)
    unlike = Stream(SENT, np.random.default_rng(1).normal(size=(len(SENT), 3)))
    assert setpoint_delay(Record(Path("c"), {**flight().streams, "setpoint": unlike})) is None
    assert setpoint_delay(flight()) is None


def test_motor_outputs_of_a_blackbox_are_what_the_escs_are_told() -> None:
    """Its header says that the motors idle at 1055 us, of 1000 to 2000."""
    (session,) = read_blackbox(DATA / "sitl.bfl")
    assert session.reach == pytest.approx((0.055, 1.0))
    assert np.allclose(session.output, 0.055 + 0.945 * session.motor)
    (record,) = read_flights(DATA / "sitl.bfl")
    assert record.streams["motor"].values.min() >= 0.055


def test_commands_that_are_made_of_setpoints_show_no_delay() -> None:
    (found,) = with_blackboxes([flight(), box()])
    setpoint = found.streams["setpoint"]
    rates = np.column_stack([np.full(len(setpoint.time), 9.81), setpoint.values])
    assert setpoint_delay(Record(Path("c"), {**found.streams, "command": Stream(setpoint.time, rates)})) is None


def test_the_gyroscope_has_the_scale_of_the_header(tmp_path: Path) -> None:
    """Half a degree per second in a count, as the hexadecimal digits of a number of 32 bits."""
    data = (DATA / "sitl.bfl").read_bytes()
    (tmp_path / "a.bbl").write_bytes(data.replace(b"gyro_scale:0x3f800000", b"gyro_scale:0x3f000000"))
    (half,), (whole,) = read_blackbox(tmp_path / "a.bbl"), read_blackbox(DATA / "sitl.bfl")
    assert np.allclose(half.gyro, 0.5 * whole.gyro) and np.ptp(whole.gyro) > 0.1
