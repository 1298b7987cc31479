"""Which modes may be on in a flight, by the slots of `aux`. By the flags: `test_instruments`."""

from dataclasses import replace

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from rich.console import Console

from e2efly.commands.fly_check import print_settings
from e2efly.flight.betaflight.allowed_modes import ARM, HARMLESS, OVERRIDE, foreign, named_mode
from e2efly.flight.betaflight.controller import ControllerInfo
from e2efly.flight.betaflight.mode_slots import ModeRange
from e2efly.flight.betaflight.msp_names import BOXES
from e2efly.flight.betaflight.settings_check import examine
from e2efly.flight.betaflight.settings_messages import RxFailConfig
from e2efly.flight.betaflight.sticks import RATES_PULSE, angle_range
from e2efly.flight.betaflight.switches import switch_rows
from e2efly.flight.row import Row, command_lines, problems
from e2efly.flight.settings import FlightSettings
from e2efly.vehicles.loading import load_vehicle
from tests.flight.test_settings_check import NEWEST, recorded

GUIDED = recorded(NEWEST)
BARE = replace(GUIDED, modes=(), box_ids=tuple(box for box in GUIDED.box_ids if box != OVERRIDE))
"""A controller that is set as the guide asks, and one without modes and mask."""
TURTLE = """
# Betaflight CLI, 4.5 or later
aux 0 0 0 1700 2100 0 0
aux 1 50 1 1700 2100 0 0
aux 2 1 2 925 2100 0 0
aux 3 35 1 1700 2100 0 0
set msp_override_channels_mask = 79
set motor_pwm_protocol = DSHOT600
feature AIRMODE
rxfail 6 s 2000
"""
IN_USE = """
aux 0 0 0 1700 2100 0 0
aux 1 45 4 1700 2100 0 0
aux 2 27 5 1700 2100 0 0
aux 3 1 2 900 1300 0 0
"""
LONGEST_LINE = 127
"""Longest line that the command line of a small controller takes."""


def typed(info: ControllerInfo, text: str) -> ControllerInfo:
    """A controller after lines were typed into its command line. Only those of switches count."""
    slots, ids, fails = {slot.slot: slot for slot in info.modes}, info.box_ids, list(info.rx_fail.channels)
    for line in text.splitlines():
        words = line.partition("#")[0].replace("=", " ").split()
        if words[:1] == ["aux"]:
            slot, box, aux, low, high, every, linked = map(int, words[1:])
            slots[slot] = ModeRange(box, aux, low, high, slot, bool(every), linked)
        elif words[:2] == ["set", "msp_override_channels_mask"]:
            ids = (*(box for box in ids if box != OVERRIDE), *((OVERRIDE,) if int(words[2]) else ()))
        elif words[:1] == ["rxfail"]:
            fails[int(words[1])] = ("SET", int(words[3]))
    modes = tuple(slot for _, slot in sorted(slots.items()) if slot.low < slot.high or slot.linked)
    return replace(info, modes=modes, box_ids=ids, rx_fail=RxFailConfig(tuple(fails)))


def rows_of(info: ControllerInfo) -> list[Row]:
    return switch_rows(info, FlightSettings())


def test_turtle_mode_on_the_switch_of_override_is_refused_by_mode_channel_and_range() -> None:
    (problem,) = problems(rows_of(typed(BARE, TURTLE)))
    assert problem == (
        "aux 3: FLIP OVER AFTER CRASH (mode 35) is AUX2 1700 to 2100; needed: off while MSP OVERRIDE is on, AUX2 1700 "
        "to 2100 (aux 3 35 8 1700 2100 0 0  # in place of FLIP OVER AFTER CRASH (mode 35), AUX2 1700 to 2100)"
    )


def test_proposed_lines_use_free_slots_and_the_modes_own() -> None:
    rows = {row.setting: row for row in rows_of(typed(BARE, IN_USE))}
    assert rows["switch of MSP OVERRIDE"].mend == ("aux 4 50 1 1700 2100 0 0",)
    assert rows["range of ANGLE"].mend == ("aux 3 1 2 925 2100 0 0  # in place of ANGLE (mode 1), AUX3 900 to 1300",)
    assert rows["msp_override_channels_mask"].mend == ("set msp_override_channels_mask=79",)
    assert rows["rxfail of AUX3"].mend == ("rxfail 6 s 2000",)
    assert [row.mend[0].partition("  #")[0] for row in rows.values() if row.setting.startswith("aux")] == [
        "aux 1 45 8 1700 2100 0 0", "aux 2 27 9 1700 2100 0 0",
    ]  # fmt: skip
    assert rows["aux 1: PARALYZE (mode 45)"].needed.startswith(
        "another channel, or --flight.channels.roll other than 9: "
    )


FIELD = {
    "freestyle, turtle on a switch of its own, modes on the channels that the bridge reads": (
        "0 0 0 1700 2100; 1 13 1 1700 2100; 2 35 2 1700 2100; 3 1 3 900 1300; 4 2 3 1300 1700; 5 46 4 1300 1700",
        {"MSP OVERRIDE", "ANGLE"}, {4, 5},
    ),
    "whoop, turtle and beeper on one switch, no override": (
        "0 0 0 1700 2100; 1 1 4 1700 2100; 2 35 1 1700 2100; 3 13 1 1300 1700; 4 0 2 900 900",
        {"MSP OVERRIDE", "ANGLE"}, set(),
    ),
    "ANGLE over the whole travel of the channel of override": (
        "0 0 0 1600 2100; 1 41 2 1600 2100; 2 43 9 1600 2100; 3 50 8 1700 2100; 4 1 8 900 2100",
        {"ANGLE"}, set(),
    ),
    "rehearsals, ANGLE and blackbox always on": (
        "0 0 0 1700 2100; 1 1 0 900 2100; 2 27 2 1700 2100; 3 26 0 900 2100; 4 50 1 1700 2100",
        {"ANGLE"}, set(),
    ),
    "armed by the sticks, override low on the channel of the mission": (
        "0 27 0 1900 2100; 1 50 3 975 1075",
        {"ARM", "MSP OVERRIDE", "ANGLE"}, set(),
    ),
    "companion, ANGLE on a switch": (
        "0 0 0 1700 2100; 1 1 1 1700 2100; 2 50 2 1700 2100",
        {"ANGLE"}, set(),
    ),
    "override over the travel of the channel of ARM": (
        "0 0 0 1700 2100; 3 50 0 1000 2000",
        {"MSP OVERRIDE", "ANGLE"}, set(),
    ),
    "joystick, turtle at the end of the travel of override": (
        "0 0 0 1300 1700; 1 2 1 1300 1700; 2 35 1 1875 2100; 3 50 1 1700 2100; 4 1 2 925 2100",
        set(), {2},
    ),
    "failsafe beyond the range of ARM, HORIZON on a switch": (
        "0 0 0 1300 1700; 1 28 1 900 1300; 2 2 1 1700 2100; 3 27 0 1700 2100; 4 13 0 1700 2100; "
        "5 50 2 1700 2100; 6 1 8 925 2100",
        set(), set(),
    ),
    "launch control at the middle of ARM": (
        "0 0 0 1300 2100; 1 49 0 1300 1700; 2 50 1 1700 2100; 3 1 2 925 2100",
        set(), {1},
    ),
    "race, all that is harmless on the switches of ARM and override": (
        "0 0 0 1700 2100; 1 36 0 1300 2100; 2 28 0 1700 2100; 3 26 0 900 2100; 4 50 1 1700 2100; "
        "5 19 1 1700 2100; 6 51 1 1300 2100; 7 52 3 900 1300; 8 39 4 1700 2100; 9 1 2 925 2100",
        set(), set(),
    ),
    "ARM on the second switch, HORIZON low and override high on the first": (
        "0 0 1 1900 2100; 1 2 0 900 1100; 2 13 2 1900 2100; 3 28 2 1400 1600; 4 50 0 1700 2100; 5 1 8 925 2100",
        set(), set(),
    ),
    "turtle on the copy of the throttle stick": (
        "0 0 0 1925 2100; 1 13 5 1850 2100; 2 28 6 1900 2100; 3 35 6 900 1150; 4 50 1 1700 2100; 5 1 2 925 2100",
        set(), {3},
    ),
    "override at the end of the switch of ARM": (
        "0 0 0 1300 2100; 1 50 0 1700 2100; 2 1 2 925 2100",
        {"MSP OVERRIDE"}, set(),
    ),
    "a second switch that leaves no position for acro": (
        "0 0 0 1700 2100; 1 50 1 1700 2100; 2 1 2 925 2100; 3 1 8 900 1300; 4 2 8 1300 2100",
        set(), {3, 4},
    ),
}  # fmt: skip
"""Switches as pilots have them, rebuilt from public documents: the slots of `aux` without logic and link, the modes
that a flight needs and that are not as needed, and the slots whose modes are refused."""


@pytest.mark.parametrize(("slots", "wrong", "refused"), FIELD.values(), ids=FIELD)
def test_switches_of_the_field_are_judged_by_what_they_do(slots: str, wrong: set[str], refused: set[int]) -> None:
    info = typed(
        BARE, "\n".join(f"aux {slot} 0 0" for slot in slots.split(";")) + "\nset msp_override_channels_mask = 79"
    )
    rows = [row for row in rows_of(info) if not row.good]
    assert {row.setting.split(" of ")[1] for row in rows if row.setting.startswith(("switch", "range"))} == wrong
    assert {int(row.setting.split()[1].rstrip(":")) for row in rows if row.setting.startswith("aux")} == refused


def test_a_number_counts_by_the_version_that_has_it() -> None:
    assert foreign({ARM, OVERRIDE, 13, 53, 54}, (1, 44)) == {53, 54}
    assert foreign({ARM, OVERRIDE, 13, 53, 54}, (1, 46)) == set()
    unknown = {1, 2, 3, 5, 6, 11, 12, 17, 20, 27, 30, 31, 35, 45, 46, 47, 49, 55, 56, 57, *range(58, 256)}
    assert foreign(unknown, (1, 49)) == unknown


def test_lines_are_whole_and_alone_in_a_pipe(capsys: pytest.CaptureFixture[str]) -> None:
    rows = examine(typed(recorded("4.5.5"), TURTLE), load_vehicle("vis_r"), FlightSettings())
    print_settings(Console(width=40), rows)
    lines = capsys.readouterr().out.splitlines()
    off = "aux 3 35 8 1700 2100 0 0  # in place of FLIP OVER AFTER CRASH (mode 35), AUX2 1700 to 2100"
    at = lines.index(off)
    assert lines[at - 1].startswith("# no: type") and lines[at + 1] == "save"
    assert lines[-5:] == [
        "set mixer_type=LEGACY", "set msp_override_failsafe=OFF", "set max_aux_channels=14",
        "set serial_update_rate_hz=1000", "save",
    ]  # fmt: skip
    assert all(row.setting in line and row.needed in line for row, line in zip(rows, lines[1:], strict=False))


@pytest.mark.parametrize(
    "lines",
    [
        [f"aux {i} 13 8 900 1300 0 0" for i in range(20)],
        [*(f"aux {i} 13 {i} 900 1300 0 0" for i in range(14)), "aux 15 0 2 900 2100 0 0"],
    ],
)
def test_where_there_is_no_place_nothing_is_replaced(lines: list[str]) -> None:
    rows = rows_of(typed(BARE, "\n".join(lines)))[:3]
    assert all(
        not row.good and row.mend == () and row.needed.endswith("first free a slot of aux, or a channel")
        for row in rows
    )


MODES = st.integers(0, 255)
PULSES = st.integers(36, 84).map(lambda step: 25 * step)
SLOTS = st.builds(
    ModeRange, MODES | st.sampled_from(sorted(BOXES)), st.integers(0, 13), PULSES, PULSES,
    every=st.booleans(), linked=st.just(0) | MODES,
)  # fmt: skip


@given(SLOTS, st.sampled_from([ARM, OVERRIDE]))
def test_whatever_is_not_known_to_be_harmless_is_refused_where_it_may_be_on(slot: ModeRange, held: int) -> None:
    """Numbers of a future version, too."""
    assume(slot.low < slot.high and slot.box not in (ARM, OVERRIDE))
    (where,) = GUIDED.slots(held)
    slot = replace(slot, slot=9, aux=where.aux)
    found = problems(rows_of(replace(GUIDED, modes=(*GUIDED.modes, slot))))
    on = slot.low < where.high and where.low < slot.high
    assert len(found) == (slot.box not in HARMLESS and (on or bool(slot.linked)))
    for text in found:
        assert named_mode(slot.box) in text
        always = slot.linked or (slot.low <= 1000 and slot.high >= 2000)
        assert f"aux 9 {'0 0 900 900' if always else f'{slot.box} 8 {slot.low} {slot.high}'} " in text


@given(st.lists(SLOTS, max_size=19), st.booleans())
def test_what_the_lines_propose_is_what_is_needed(slots: list[ModeRange], mask: bool) -> None:
    """Typed into any controller with a free slot, they leave nothing that is refused, and no other mode is lost."""
    modes = tuple(replace(s, slot=i) for i, s in enumerate(slots) if s.low < s.high or s.linked)
    assume(len({slot.aux for slot in modes} | {3, 4, 5, 6, 7}) <= 11)
    assume(len(modes) <= 17)
    before = replace(GUIDED if mask else BARE, modes=modes)
    rows = rows_of(before)
    lines = command_lines(row for row in rows if not row.good)
    after = typed(before, "\n".join(lines))
    assert problems(rows_of(after)) == ()
    left = {slot.slot: slot for slot in after.modes}
    for slot in before.modes:
        if left.get(slot.slot) != slot:
            assert slot.box not in HARMLESS
            assert any(line.startswith(f"aux {slot.slot} ") and named_mode(slot.box) in line for line in lines)
    assert all(len(line) <= LONGEST_LINE for line in lines)


def active(slots: tuple[ModeRange, ...], pulses: list[int]) -> set[int]:
    """The modes that the firmware makes active, as `updateActivatedModes` of its `rc_modes.c` does."""
    conditions = dict[int, tuple[list[bool], list[bool]]]()

    def on(box: int) -> bool:
        any_of, all_of = conditions.get(box, ([], []))
        return any(any_of) or (bool(all_of) and all(all_of))

    for slot in sorted(slots, key=lambda slot: slot.linked != 0):
        now = on(slot.linked) if slot.linked else slot.low <= pulses[slot.aux] < slot.high
        conditions.setdefault(slot.box, ([], []))[slot.every].append(now)
    return {box for box in conditions if on(box)}


@given(st.lists(SLOTS, max_size=17), st.data())
def test_what_passes_has_nothing_harmful_on_under_override(slots: list[ModeRange], data: st.DataObject) -> None:
    """Wherever the pilot has the switches of arming, override and mission; all others are off."""
    before = replace(BARE, modes=tuple(replace(s, slot=i) for i, s in enumerate(slots) if s.low < s.high or s.linked))
    assume(len({slot.aux for slot in before.modes} | {3, 4, 5, 6, 7}) <= 11)
    info = typed(before, "\n".join(command_lines(row for row in rows_of(before) if not row.good)))
    held = [slot for slot in info.modes if slot.box in (ARM, OVERRIDE)]
    moved = {slot.aux for slot in held} | {3, 4, 5, 6, 7}
    harmful = [slot for slot in info.modes if slot.box not in (ARM, OVERRIDE, *HARMLESS)]
    angle = angle_range(info)
    free = [
        [pulse for pulse in range(1000, 2000, 25) if not any(s.aux == aux and s.low <= pulse < s.high for s in harmful)]
        for aux in range(14)
    ]
    free[angle.aux] = [RATES_PULSE]
    choices = [range(900, 2100, 25) if aux in moved else free[aux] for aux in range(14)]
    pulses = [data.draw(st.sampled_from(choice)) for choice in choices]
    for slot in held:
        pulses[slot.aux] = slot.low
    assert foreign(active(info.modes, pulses), info.api) == set()
