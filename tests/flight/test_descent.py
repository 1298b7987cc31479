"""The watchdog's descent by the accelerometer, on a vehicle that falls and stands in plain arithmetic."""

from dataclasses import replace

import pytest

from e2efly.flight.attitude import Attitude
from e2efly.flight.betaflight.descent import Descent, Sense, command, feel, move, sent
from e2efly.flight.betaflight.messages import RawImu
from e2efly.vehicles.gravity import GRAVITY

SENSE = Sense(
    GRAVITY / 2048, (0.0, 10.0, 20.0), (1000, 1500, 2000), doubt=0.05, share=1.0, velocity=(0.0, 0.0, 0.0),
    upright=1.0, height=2.0,
)  # fmt: skip
LEVEL = Attitude(0.0, 0.0, 0.0)
DT = 0.01


def flown(
    height: float, strength: float = 1.0, gone: tuple[float, float] = (9.0, 9.0), held: float = GRAVITY
) -> tuple[float, float, float]:
    """Height when the descent is over, m, speed of the touch, m/s, and when it is over, s."""
    fall, z, v, touch, acts, now = Descent.of(SENSE, 5.0, held, 0.0, 0.0), height, 0.0, 0.0, held, 0.0
    for i in range(3000):
        now, alive = DT * i, not gone[0] <= DT * i < gone[1]
        fall = move(fall, SENSE, LEVEL, now, alive=alive)
        if fall.over:
            break
        fall, wanted, _ = command(fall, LEVEL, DT)
        acts = wanted if alive else acts
        fall = sent(fall, acts, now)
        force = strength * fall.acting(now)
        if z <= 0 and force < GRAVITY:
            touch, force, v = max(touch, -v), GRAVITY, 0.0
        v, z = v + (force - GRAVITY) * DT, max(z + v * DT, 0.0)
        if alive and i % 2:
            fall = feel(fall, SENSE, RawImu((i % 3, 0, round(force * 2048 / GRAVITY)), (0.0, 0.0, 0.0)), now)
    return z, touch, now


@pytest.mark.parametrize("strength", [0.93, 1.0, 1.04])
def test_it_touches_gently_and_ends_soon_after(strength: float) -> None:
    z, touch, over = flown(2.0, strength)
    assert z == 0.0 and 0 < touch < 1.5 and over < 7.0


def test_a_vehicle_that_climbed_while_the_link_was_gone_is_not_dropped() -> None:
    z, _, over = flown(0.1, gone=(0.0, 3.0), held=1.2 * GRAVITY)
    assert z == 0.0 and over > 6.0


def test_it_begins_with_the_motion_that_the_held_thrust_has_given_since_the_plan() -> None:
    """A bridge that is stopped while it pulls up leaves a vehicle that climbs."""
    tilted = replace(SENSE, upright=0.8)
    for sense, climb in ((SENSE, 0.2 * 0.5 * GRAVITY), (tilted, (0.8 * 1.5 - 1) * 0.2 * GRAVITY)):
        fall = Descent.of(sense, 5.0, 1.5 * GRAVITY, 0.0, 0.2)
        assert fall.climb == pytest.approx(climb)
        assert fall.height == pytest.approx(2.0 + 0.2 * climb)
        assert fall.doubt > 0.2 * 0.05 * GRAVITY


@pytest.mark.parametrize(("name", "value"), [("unit", -1.0), ("share", 0.0), ("pulses", (1, 2)), ("forces", (1.0,))])
def test_what_cannot_be_flown_by_is_refused(name: str, value: object) -> None:
    with pytest.raises(ValueError, match=f"sense: {name} is "):
        Sense(**{**vars(SENSE), name: value})
