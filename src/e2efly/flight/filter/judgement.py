"""What becomes of a wanted command, from the state at which it begins to act."""

from typing import Any

from e2efly.flight.filter.arithmetic import SCALARS, Number
from e2efly.flight.filter.backup import Backup, brake, command
from e2efly.flight.filter.forecast import ForecastCommand, ForecastMotion, Residual, moved
from e2efly.flight.filter.margins import MarginLimits, against, retreat, rooms
from e2efly.flight.filter.obstacle import Plane

HOLD = 0.01
"""A command is judged as if it were held for this time, s."""
HALVINGS = 3
"""How many times the share of the change is halved: down to an eighth."""


def judged(
    xp: Any,
    b: Backup,
    limits: MarginLimits,
    m: ForecastMotion,
    air: Residual,
    wanted: ForecastCommand,
    solids: tuple[Plane, ...],
    floor: Number,
) -> tuple[ForecastCommand, Number, Number, Any]:
    """The command to give, the share by which it is changed, and the smallest room after the wanted one, m, with the
    index of its limit. `m` is the state when the command begins to act, and `solids` are the sides near it.
    """
    step = b.response.step(HOLD)

    def left(c: ForecastCommand) -> tuple[Number, ...]:
        return rooms(xp, b, limits, moved(xp, b.response, m, c, air, step), air, solids, floor, m)

    short, limit = worst(xp, left(wanted))
    if xp is SCALARS and short >= 0.0:
        return wanted, 0.0, short, limit
    back = retreat(xp, limits, m, floor)
    own = command(xp, b, m, brake(xp, b, m, against(xp, m, air), back))
    share = _least(xp, lambda s: worst(xp, left(_between_two(wanted, own, s)))[0], 0.0 * short)
    passes = short >= 0.0
    share = xp.where(passes, 0.0, share)
    given = ForecastCommand(*(
        xp.where(passes, a, xp.where(share >= 1.0, c, a + share * (c - a))) for a, c in zip(wanted, own, strict=True)
    ))  # fmt: skip
    return given, share, short, limit


def worst(xp: Any, rooms: tuple[Number, ...]) -> tuple[Number, Any]:
    """The smallest room, NaN if a room is no finite number, and the index of its limit."""
    if xp is SCALARS:
        least = min(rooms)
        return least + 0.0 * sum(rooms), rooms.index(least)
    least, index = rooms[0], 0
    for i, room in enumerate(rooms[1:], start=1):
        less = room < least
        least, index = xp.where(less, room, least), xp.where(less, i, index)
    return least + 0.0 * sum(rooms), index


def _least(xp: Any, spare: Any, zero: Number) -> Number:
    """The smallest share, in eighths, by which a command must be changed so that enough room is left. 1 if no smaller
    share is enough.
    """
    low, high = zero, zero + 1.0
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        good = spare(middle) >= 0.0
        low, high = xp.where(good, low, middle), xp.where(good, middle, high)
    return high


def _between_two(a: ForecastCommand, b: ForecastCommand, share: Number) -> ForecastCommand:
    return ForecastCommand(*(x + share * (y - x) for x, y in zip(a, b, strict=True)))
