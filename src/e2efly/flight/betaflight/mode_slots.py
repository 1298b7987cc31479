"""MSP messages about the switches of modes: the slots of the command line's `aux`. Pure functions; see `messages`."""

import struct
from dataclasses import dataclass, replace
from typing import ClassVar

from e2efly.flight.betaflight.messages import unpack


@dataclass(frozen=True)
class ModeRange:
    """When a switch makes a mode active: one slot of the command line's `aux`.

    A mode is active while any of its slots is. Slots with `every` count together, as one that is active while all of
    them are.
    """

    box: int
    """Permanent id of the mode: a key of `BOXES`."""
    aux: int
    """The AUX channel, from 0."""
    low: int
    """Active from this pulse on, µs."""
    high: int
    """Active below this pulse, µs."""
    slot: int = 0
    """Its number in the command line."""
    every: bool = False
    """Whether every other slot of this kind must be active, too."""
    linked: int = 0
    """Permanent id of the mode that it follows, whatever the channel. 0: none."""

    def overlaps(self, other: "ModeRange") -> bool:
        """Whether both ranges can be active at one position of one channel."""
        return self.aux == other.aux and self.low < other.high and other.low < self.high

    def covers(self, low: int, high: int) -> bool:
        """Whether all pulses from `low` to `high`, µs, make the mode active, by this slot alone."""
        return self.low <= low and high < self.high and not self.every and not self.linked


@dataclass(frozen=True)
class ModeRanges:
    """The channel and the range of each slot of `aux`."""

    CODE: ClassVar[int] = 34
    slots: tuple[ModeRange, ...]

    @staticmethod
    def parse(payload: bytes) -> "ModeRanges":
        """Read a reply."""
        entries = struct.iter_unpack("BBBB", payload[: len(payload) // 4 * 4])
        slots = (ModeRange(box, aux, 900 + 25 * a, 900 + 25 * b, i) for i, (box, aux, a, b) in enumerate(entries))
        return ModeRanges(tuple(slots))


@dataclass(frozen=True)
class ModeLogic:
    """How the slots of `aux` act together."""

    CODE: ClassVar[int] = 238
    slots: tuple[tuple[int, bool, int], ...]
    """`box`, `every` and `linked` of each slot; see `ModeRange`."""

    @staticmethod
    def parse(payload: bytes) -> "ModeLogic":
        """Read a reply."""
        (count,) = unpack("MODE_RANGES_EXTRA", "B", payload)
        values = unpack("MODE_RANGES_EXTRA", f"x{3 * count}B", payload)
        return ModeLogic(tuple((values[i], bool(values[i + 1]), values[i + 2]) for i in range(0, 3 * count, 3)))


def mode_ranges(ranges: ModeRanges, logic: ModeLogic) -> tuple[ModeRange, ...]:
    """The slots that are in use.

    Raises:
        ValueError: the two messages are not about the same slots.
    """
    boxes = [slot.box for slot in ranges.slots], [box for box, *_ in logic.slots]
    if boxes[0] != boxes[1]:
        raise ValueError(f"MSP MODE_RANGES_EXTRA: its modes are {boxes[1]}; accepted: those of MODE_RANGES, {boxes[0]}")
    slots = (
        replace(slot, every=every, linked=linked)
        for slot, (_, every, linked) in zip(ranges.slots, logic.slots, strict=True)
    )
    return tuple(slot for slot in slots if slot.low < slot.high or slot.linked)


@dataclass(frozen=True)
class BoxIds:
    """The modes that the controller knows."""

    CODE: ClassVar[int] = 119
    ids: tuple[int, ...]
    """Permanent ids, in the order of the bits of `StatusEx.boxes`."""

    @staticmethod
    def parse(payload: bytes) -> "BoxIds":
        """Read a reply."""
        return BoxIds(tuple(payload))
