"""The versions of Betaflight that are known, and those that are refused by name."""

import struct

import pytest

from e2efly.flight.betaflight.messages import FcVersion, StatusEx
from e2efly.flight.betaflight.msp_names import BOXES
from e2efly.flight.betaflight.versions import RELEASES, release_of, version_text

NEWEST = RELEASES[-1]


def said(year: int, month: int, patch: int, text: str = "") -> bytes:
    """An FC_VERSION as firmware writes it since MSP 1.47."""
    return bytes([year, month, patch, len(text)]) + text.encode()


@pytest.mark.parametrize(
    ("api", "payload", "name", "hand_back"),
    [
        ((1, 44), bytes([4, 3, 2]), "4.3", "held for as long as override is on"),
        ((1, 46), bytes([4, 5, 5]), "4.5", "held for as long as override is on"),
        ((1, 47), bytes([4, 6, 0]), "4.6", "held for as long as override is on"),
        ((1, 47), said(25, 12, 5, "2025.12.5"), "2025.12", "held for as long as override is on"),
        ((1, 48), said(26, 6, 0, "2026.6.0-rc1"), "2026.6", "handed back to the receiver after 0.3 s"),
        ((1, 48), said(26, 6, 1, "2026.6.1"), "2026.6", "handed back to the receiver after 0.3 s"),
        ((1, 49), said(26, 12, 0, "2026.12.0-alpha"), "2026.12", "handed back to the receiver after 0.3 s"),
    ],
)
def test_each_release_is_known_by_what_it_says(api: tuple[int, int], payload: bytes, name: str, hand_back: str) -> None:
    version = FcVersion.parse(payload)
    release = release_of(api, version.version, version.text)
    assert (release.name, release.hand_back) == (name, hand_back)


def test_the_year_is_told_since_2000() -> None:
    assert FcVersion.parse(said(26, 6, 1, "2026.6.1")) == FcVersion((26, 6, 1), "2026.6.1")
    assert FcVersion.parse(bytes([26, 6, 1])) == FcVersion((26, 6, 1), "")
    assert version_text((26, 6, 1)) == "2026.6.1"
    assert version_text((4, 5, 2)) == "4.5.2"


@pytest.mark.parametrize(
    ("api", "payload", "words"),
    [
        ((1, 43), bytes([4, 2, 11]), r"Betaflight 4\.2\.11, MSP 1\.43; accepted: 4\.3 \(MSP 1\.44\), .*flash one"),
        ((1, 50), said(27, 6, 0, "2027.6.0"), r"is Betaflight 2027\.6\.0, MSP 1\.50; .* look for a newer e2efly"),
        ((1, 47), said(26, 6, 0, "2026.6.0-alpha"), r"Betaflight 2026\.6\.0-alpha, MSP 1\.47; accepted"),
        ((1, 48), said(26, 6, 0, "2026.6.0-alpha"), r"2026\.6\.0-alpha; accepted: 2026\.6\.0-rc1 .* flash 2026\.6\.1"),
    ],
)
def test_others_are_refused_by_name_with_what_to_do(api: tuple[int, int], payload: bytes, words: str) -> None:
    version = FcVersion.parse(payload)
    with pytest.raises(ValueError, match=words):
        release_of(api, version.version, version.text)


def test_each_is_listed_once_in_order() -> None:
    assert [r.api for r in RELEASES] == sorted(r.api for r in RELEASES)
    assert len({r.series for r in RELEASES}) == len(RELEASES)
    for release in RELEASES:
        if release.sitl is not None:
            assert sorted(release.sitl.motors) == [0, 1, 2, 3] and release.sitl.yaw_sign in (1, -1)


@pytest.mark.parametrize(("count", "name"), [(26, "ARM_SWITCH"), (29, "ARM_SWITCH"), (30, "AUTOPILOT_SW")])
def test_reasons_against_arming_are_counted_as_the_version_counts_them(count: int, name: str) -> None:
    """The last is always the switch; 1.48 has put another before it."""
    bit = {26: 25, 29: 28, 30: 28}[count]
    payload = struct.pack("<HHHIBHBBBBIB", 250, 0, 0, 0, 0, 0, 4, 0, 0, count, 1 << bit, 0)
    assert StatusEx.parse(payload + bytes(5)).arming_disabled == (name,)


def test_override_and_the_modes_that_meddle_are_known_by_number() -> None:
    assert (BOXES[50], BOXES[56]) == ("MSP OVERRIDE", "AUTOPILOT")
