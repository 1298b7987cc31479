"""The pilot's switches in the table of `e2efly fly --check`: the modes that a flight needs, and those that it forbids.

A mode that is not known to be harmless must be off while MSP OVERRIDE is on and while the vehicle is armed. A slot of
`aux` that contradicts this is refused. Where a mode has a switch of its own, only the controller's flags tell whether
it is on: see `instruments`. Slots that act together with others are judged as if each acted alone, so that a mode
counts as on wherever it may be on.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field, replace

from e2efly.flight.betaflight.allowed_modes import ANGLE, ARM, OVERRIDE, harmless, named_mode
from e2efly.flight.betaflight.controller import ControllerInfo
from e2efly.flight.betaflight.mode_slots import ModeRange
from e2efly.flight.betaflight.msp_names import BOXES
from e2efly.flight.betaflight.sticks import RATES_PULSE, angle_range
from e2efly.flight.row import Row
from e2efly.flight.settings import FlightSettings

SLOTS, AUX_CHANNELS = 20, 14
"""Number of slots of `aux`, and of AUX channels, that a controller has."""
GUIDE = {
    ARM: ModeRange(ARM, 0, 1700, 2100),
    OVERRIDE: ModeRange(OVERRIDE, 1, 1700, 2100),
    ANGLE: ModeRange(ANGLE, 2, 925, 2100),
}
"""The ranges of the guide. Their channels are proposed where they are free."""
FULL = "; first free a slot of aux, or a channel"
"""What else is needed, where there is no place for a mode."""
ALWAYS = (1000, 2000)
"""A mode that all pulses between these make active is on whatever the position of its switch, us."""


@dataclass
class _Plan:
    """Where the modes that a flight needs can be put."""

    slots: tuple[ModeRange, ...]
    """The slots that are in use."""
    taken: set[int]
    """The AUX channels that are no place for them."""
    free: list[int] = field(init=False)
    """The numbers of the slots that are not in use."""
    moved: dict[int, int] = field(default_factory=dict)
    """The new channel of each channel whose modes move away together."""

    def __post_init__(self) -> None:
        self.free = sorted(set(range(SLOTS)) - {slot.slot for slot in self.slots})

    def put(self, box: int, old: ModeRange | None) -> ModeRange | None:
        """A slot for a mode on a channel of its own, in place of its old slot. None: no slot or no channel is free."""
        if old is None and not self.free:
            return None
        aux = self._channel([*([] if old is None or old.linked else [old.aux]), GUIDE[box].aux], old)
        if aux is None:
            return None
        return replace(GUIDE[box], aux=aux, slot=self.free.pop(0) if old is None else old.slot)

    def move(self, slot: ModeRange) -> ModeRange | None:
        """The slot with its switch on another channel. None: no channel is free."""
        if slot.aux not in self.moved and (aux := self._channel([], None)) is not None:
            self.moved[slot.aux] = aux
        return replace(slot, aux=self.moved[slot.aux]) if slot.aux in self.moved else None

    def _channel(self, places: list[int], old: ModeRange | None) -> int | None:
        """A channel that nothing but `old` uses, one of `places` if possible. It is taken then."""
        used = self.taken | {slot.aux for slot in self.slots if slot is not old}
        aux = next((aux for aux in (*places, *range(AUX_CHANNELS)) if aux not in used), None)
        self.taken |= set() if aux is None else {aux}
        return aux


def switch_rows(info: ControllerInfo, settings: FlightSettings) -> list[Row]:
    """The rows of ARM, MSP OVERRIDE and ANGLE, and of each slot with a mode that is not known to be harmless."""
    c = settings.channels
    read = {"mission": c.mission, "roll": c.roll, "pitch": c.pitch, "throttle": c.throttle, "yaw": c.yaw}
    bridge = {channel - 5: name for name, channel in read.items() if channel is not None}
    plan, arm = _Plan(info.modes, set(bridge)), {slot.aux for slot in info.slots(ARM)}
    rows = [_switch(info, plan, box, others) for box, others in ((ARM, {*bridge}), (OVERRIDE, {*bridge, *arm}))]
    angle, have = angle_range(info), info.slots(ANGLE)
    good, old = angle is not None and angle.aux not in bridge, angle or (have[0] if have else None)
    new = None if good else plan.put(ANGLE, old)
    rows.append(
        Row("range of ANGLE", where(*have), "925 to 2100 on a channel of its own: on, but for the "
            f"{RATES_PULSE} us that the bridge sends there" + ("" if good or new else FULL), good, _lines(new, old))
    )  # fmt: skip
    rows += _of_angle(info, (angle if good else new) or GUIDE[ANGLE], good=good)
    doubtful = [
        slot
        for slot in info.modes
        if slot is not old and slot.box not in (ARM, OVERRIDE) and not harmless(slot.box, info.api)
    ]
    for slot in doubtful:
        always = "no link: it can be on at any time" if slot.linked else ""
        if _always(slot, doubtful):
            always = "off at one position of its switch, and so what else is on this channel"
        why = always or _why_not(slot, info, bridge)
        mend = () if not why else (_off(slot),) if always else _lines(plan.move(slot), slot) or (_off(slot),)
        needed = why or "any: off before take-off"
        rows.append(Row(f"aux {slot.slot}: {named_mode(slot.box)}", where(slot), needed, not why, mend))
    return rows


def _switch(info: ControllerInfo, plan: _Plan, box: int, others: set[int]) -> Row:
    """ARM or MSP OVERRIDE. `others` are the channels that it must not have."""
    have = info.slots(box)
    wrong = [slot for slot in have if slot.linked or _always(slot, have) or slot.aux in others]
    mend = tuple(map(_off, wrong))
    if len(wrong) == len(have):  # none is left
        old = wrong[0] if wrong else None
        mend = _lines(plan.put(box, old), old) + mend[1:]
    good = bool(have) and not wrong
    needed = "a switch of the pilot's on a channel of its own, not always on" + ("" if good or mend else FULL)
    return Row(f"switch of {BOXES[box]}", where(*have), needed, good, mend)


def _of_angle(info: ControllerInfo, angle: ModeRange, *, good: bool) -> list[Row]:
    """What else the channel of ANGLE needs. `good`: it is what the controller has, and not a proposal."""
    place = 4 + angle.aux
    mask = 15 | 1 << (info.rx_map.channel[place] if place < len(info.rx_map.channel) else place)
    known = OVERRIDE in info.box_ids
    fail = info.rx_fail.channels[place : place + 1]
    levels = not fail or (fail[0][0] == "SET" and angle.low <= fail[0][1] < angle.high)
    return [
        Row("msp_override_channels_mask", "set, to what is not told" if known else "0", f"{mask}: the sticks and "
            f"AUX{angle.aux + 1} of ANGLE (tried before arming)", known and good,
            (f"set msp_override_channels_mask={mask}",)),
        Row(f"rxfail of AUX{angle.aux + 1}", f"{fail[0][0]} {fail[0][1]} us" if fail else "not told",
            "SET within ANGLE's range: level without the receiver", levels, (f"rxfail {place} s 2000",)),
    ]  # fmt: skip


def _why_not(slot: ModeRange, info: ControllerInfo, bridge: dict[int, str]) -> str:
    """What is needed of the channel of a mode that may do harm. Empty: it is as needed."""
    for held in (*info.slots(OVERRIDE), *info.slots(ARM)):
        if slot.overlaps(held):
            return f"off while {BOXES[held.box]} is on, {where(held)}"
    if slot.aux in bridge:
        name = bridge[slot.aux]
        return f"another channel, or --flight.channels.{name} other than {slot.aux + 5}: the bridge reads this one"
    return ""


def _always(slot: ModeRange, slots: Iterable[ModeRange]) -> bool:
    """Whether some of these slots leave no position of the slot's switch at which all of them are off."""
    same = [other for other in slots if other.aux == slot.aux and not other.linked]
    return all(any(other.low <= pulse < other.high for other in same) for pulse in range(*ALWAYS, 25))


def where(*slots: ModeRange) -> str:
    """The channels and ranges of slots, in words."""
    said = (
        f"linked to {named_mode(slot.linked)}"
        if slot.linked
        else f"AUX{slot.aux + 1} {slot.low} to {slot.high}{' together with others' * slot.every}"
        for slot in slots
    )
    return ", ".join(said) or "none"


def _lines(new: ModeRange | None, old: ModeRange | None) -> tuple[str, ...]:
    """The line for the command line that writes a slot, and what it replaces."""
    if new is None:
        return ()
    line = f"aux {new.slot} {new.box} {new.aux} {new.low} {new.high} {int(new.every)} 0"
    return (line + (f"  # in place of {named_mode(old.box)}, {where(old)}" if old else ""),)


def _off(slot: ModeRange) -> str:
    """The line that empties a slot."""
    return _lines(ModeRange(0, 0, 900, 900, slot.slot), slot)[0]
