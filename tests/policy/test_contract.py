"""The contract: what it keeps, and what it refuses."""

import copy
import dataclasses
import json
import math
import re
from collections.abc import Iterator
from functools import reduce
from typing import Any

import pytest

from e2efly.config.domain import Extent
from e2efly.policy.contract import ACTION_MAPPING, Contract
from e2efly.policy.observation import Company

Path = tuple[str | int, ...]

EXAMPLE = {
    "contract_version": 2,
    "e2efly_version": "0.1.0",
    "task": "hover",
    "vehicle": "vis_r",
    "vehicle_hash": "0123456789abcdef",
    "control_rate_hz": 30.0,
    "latency_s": 0.05,
    "latency_range_s": [0.04, 0.06],
    "observation_latency_range_s": [0.0, 0.0],
    "observation": [
        {"name": "goal", "size": 6, "frame": "world", "unit": "m", "scale": 4.0, "description": "two goals"},
        {"name": "attitude", "size": 4, "frame": "world_body", "unit": "1", "scale": 1.0, "description": "wxyz"},
        {"name": "body_rate", "size": 3, "frame": "body", "unit": "rad/s", "scale": 4.0, "description": "of the body"},
    ],
    "images": [
        {
            "name": "image_0",
            "sees": "mask",
            "of": "pad",
            "width": 64,
            "height": 48,
            "projection": "pinhole",
            "fov_rad": [1.5, 1.0],
            "reach_m": [0.0, 20.0],
            "position_m": [0.1, 0.0, -0.02],
            "pitch_rad": 1.57,
            "rate_hz": 15.0,
            "latency_range_s": [0.02, 0.03],
            "encoding": "none",
            "pool": [12, 16],
            "description": "1 where pad is seen, else 0",
            "preprocessing": "averaged",
        },
        {
            "name": "image_1",
            "sees": "range",
            "of": "none",
            "width": 360,
            "height": 16,
            "projection": "spherical",
            "fov_rad": [6.28, 0.5],
            "reach_m": [0.3, 50.0],
            "position_m": [0.0, 0.0, 0.0],
            "pitch_rad": 0.0,
            "rate_hz": 30.0,
            "latency_range_s": [0.0, 0.0],
            "encoding": "inverse",
            "pool": [16, 360],
            "description": "distance, m",
            "preprocessing": "convolved",
        },
    ],
    "memory_size": 32,
    "action": {
        "mode": "ctbr",
        "fields": ["collective_thrust", "roll_rate", "pitch_rate", "yaw_rate"],
        "units": ["m/s^2", "rad/s", "rad/s", "rad/s"],
        "low": [0.0, -10.0, -10.0, -4.0],
        "high": [27.3, 10.0, 10.0, 4.0],
        "limits": [-1.0, 1.0],
        "mapping": "command = low + (action + 1) / 2 * (high - low)",
    },
    "hover_action": [-0.28, 0.0, 0.0, 0.0],
}


GONE = object()


def changed(path: Path, value: Any) -> str:
    """The example as JSON with one value changed, or gone."""
    content = copy.deepcopy(EXAMPLE)
    table = reduce(lambda inside, key: inside[key], path[:-1], content)
    table[path[-1]] = value
    if value is GONE:
        del table[path[-1]]
    return json.dumps(content)


def nodes(value: Any = EXAMPLE, path: Path = ()) -> Iterator[Path]:
    """The path of every value, tables and lists included."""
    if path:
        yield path
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, entry in items:
        yield from nodes(entry, (*path, key))


def spelled(path: Path) -> str:
    """A path as an error names it: observation[0].scale."""
    return "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in path).lstrip(".")


def test_round_trip_keeps_everything() -> None:
    contract = Contract.from_json(json.dumps(EXAMPLE))
    assert json.loads(contract.to_json()) == EXAMPLE
    assert Contract.from_json(contract.to_json()) == contract
    assert (contract.task, contract.action.high[0], contract.observation[0].scale) == ("hover", 27.3, 4.0)


SENSED = [
    {"name": "velocity_lag", "unit": "s", "low": 0.0, "high": 0.08},
    {"name": "dropped", "unit": "1", "low": 0.0, "high": 0.1},
]
"""The sensing that a training covered."""


def test_the_sensing_of_the_training_is_kept_and_a_file_of_before_has_none() -> None:
    contract = Contract.from_json(json.dumps(EXAMPLE | {"sensing": SENSED}))
    assert contract.sensing == (Extent("velocity_lag", "s", 0.0, 0.08), Extent("dropped", "1", 0.0, 0.1))
    assert Contract.from_json(contract.to_json()) == contract
    assert Contract.from_json(json.dumps(EXAMPLE)).sensing is None
    assert "sensing" not in json.loads(Contract.from_json(json.dumps(EXAMPLE)).to_json())


@pytest.mark.parametrize(
    ("key", "value", "said"),
    [
        ("name", "velocity_leg", "sensing[0].name is 'velocity_leg'; accepted: 'position_lag' or 'velocity_lag'"),
        ("unit", "ms", "sensing[0].unit is 'ms'; accepted: 's', as its name is 'velocity_lag'"),
        ("low", -0.1, "sensing[0].low is -0.1; accepted: 0 or more"),
        ("low", 0.1, "sensing[0].low is 0.1; accepted: at most sensing[0].high, 0.08"),
        ("high", math.nan, "sensing[0].high is nan; accepted: a finite number"),
        ("hihg", 0.1, "unknown key 'sensing[0].hihg'; did you mean 'high'"),
    ],
)
def test_a_sensing_that_makes_no_sense_is_refused_by_name(key: str, value: Any, said: str) -> None:
    text = json.dumps(EXAMPLE | {"sensing": [SENSED[0] | {key: value}, SENSED[1]]})
    with pytest.raises(ValueError, match=re.escape(said)):
        Contract.from_json(text)


KNOWN = {"count": 2, "fields": ["others"], "max_age_s": 0.1, "range_m": 7.1, "speed_m_s": 5.0}
"""What a policy needs to know of others."""
AMONG = EXAMPLE | {
    "others": KNOWN,
    "observation": [
        *EXAMPLE["observation"],
        {"name": "others", "size": 6, "frame": "world", "unit": "m", "scale": 2.0, "description": "others"},
    ],
}


def test_what_is_needed_of_others_is_kept_and_a_file_of_before_has_none() -> None:
    contract = Contract.from_json(json.dumps(AMONG))
    assert contract.others == Company(2, ("others",), 0.1, 7.1, 5.0)
    assert Contract.from_json(contract.to_json()) == contract
    assert Contract.from_json(json.dumps(EXAMPLE)).others is None
    assert "others" not in json.loads(Contract.from_json(json.dumps(EXAMPLE)).to_json())


@pytest.mark.parametrize(
    ("key", "value", "said"),
    [
        ("count", 3, "others.count is 3; accepted: 2, as in the observation"),
        ("fields", ["othesr"], "others.fields[0] is 'othesr'; accepted: "),
        ("max_age_s", 0.0, "others.max_age_s is 0.0; accepted: more than 0"),
        ("range_m", -1.0, "others.range_m is -1.0; accepted: more than 0"),
        ("speed_m_s", math.inf, "others.speed_m_s is inf; accepted: a finite number"),
        ("rnage_m", 1.0, "unknown key 'others.rnage_m'; did you mean 'range_m'"),
    ],
)
def test_a_need_of_others_that_makes_no_sense_is_refused_by_name(key: str, value: Any, said: str) -> None:
    with pytest.raises(ValueError, match=re.escape(said)):
        Contract.from_json(json.dumps(AMONG | {"others": KNOWN | {key: value}}))


def test_layout() -> None:
    contract = Contract.from_json(json.dumps(EXAMPLE))
    assert contract.observation_size == 13
    assert contract.slices == {"goal": slice(0, 6), "attitude": slice(6, 10), "body_rate": slice(10, 13)}
    assert contract.attitude == "attitude"


def test_the_mapping_is_written_as_it_is_computed() -> None:
    assert ACTION_MAPPING == "command = low + (action + 1) / 2 * (high - low)"


@pytest.mark.parametrize("path", list(nodes()), ids=spelled)
def test_a_value_of_the_wrong_type_is_refused_by_name(path: Path) -> None:
    whole_list = len(path) > 2 and path[1] in ("fields", "units")  # these are shown as one
    name = re.escape(spelled(path[:2] if whole_list else path))
    for value in (None, True, "", math.nan, *([[]] if path != ("images",) else [])):  # no images is a policy, too
        with pytest.raises(ValueError, match=rf"^contract: {name} is .*; accepted: \S"):
            Contract.from_json(changed(path, value))
    with pytest.raises(ValueError, match=rf"^contract: ({name} is .*; accepted: \S|missing key '{name}\.)"):
        Contract.from_json(changed(path, {}))


@pytest.mark.parametrize("path", [p for p in nodes() if isinstance(p[-1], str)], ids=spelled)
def test_a_missing_key_is_named(path: Path) -> None:
    with pytest.raises(ValueError, match=f"missing key '{re.escape(spelled(path))}'"):
        Contract.from_json(changed(path, GONE))


def test_a_recurrent_policy_of_before_memory_was_in_the_contract_is_told_what_lacks() -> None:
    with pytest.raises(
        ValueError, match=r"^contract: missing key 'memory_size'; accepted: all of .*memory_size.*again"
    ):
        Contract.from_json(changed(("memory_size",), GONE))


@pytest.mark.parametrize("path", [("tusk",), ("action", "lov"), ("observation", 1, "nome")], ids=spelled)
def test_an_unknown_key_is_named_with_what_was_meant(path: Path) -> None:
    meant = {"tusk": "task", "lov": "low", "nome": "name"}[str(path[-1])]
    with pytest.raises(ValueError, match=f"unknown key '{re.escape(spelled(path))}'; did you mean '{meant}'"):
        Contract.from_json(changed(path, 1.0))


@pytest.mark.parametrize(
    ("path", "value", "accepted"),
    [
        (("contract_version",), 1, "2; export it again"),
        (("contract_version",), 2.0, "2; export it again"),
        (("vehicle_hash",), "0123456789ABCDEF", "16 hex digits"),
        (("vehicle_hash",), "0123", "16 hex digits"),
        (("control_rate_hz",), 0, "0.1 to 10000 Hz"),
        (("control_rate_hz",), 1e-9, "0.1 to 10000 Hz"),
        (("control_rate_hz",), 20_000.0, "0.1 to 10000 Hz"),
        (("control_rate_hz",), 1e308, "a finite number, at most 1e+06 in size"),
        (("action", "high"), [27.3, 10.0, 10.0, 1e308], "a finite number, at most 1e+06 in size"),
        (("images", 0, "width"), 10**400, "a whole number, 1 or more, at most 1e+06"),
        (("images", 1, "rate_hz"), 1e-308, "0.01 Hz or more"),
        (("control_rate_hz",), 10**400, "a finite number"),
        (("latency_s",), 0.07, "within latency_range_s"),
        (("latency_range_s",), [0.06, 0.04], "two rising numbers"),
        (("latency_range_s",), [-0.01, 0.06], "two rising numbers"),
        (("latency_range_s",), [0.04, 1.1], "two rising numbers of seconds in [0, 1]"),
        (("latency_range_s",), [0.04, 0.05, 0.06], "a list of 2 numbers"),
        (("images", 0, "latency_range_s"), [0.03, 0.02], "images[0].latency_range_s is [0.03, 0.02]; accepted: two"),
        (("images", 0, "reach_m"), [5.0, 1.0], "two rising numbers of metres"),
        (("observation_latency_range_s",), [0.0, 1e6], "two rising numbers of seconds in [0, 1]"),
        (("observation", 0, "frame"), "body_world", "'world' or 'body'"),
        (("observation", 0, "size"), 0, "a whole number, 1 or more"),
        (("observation", 0, "size"), 6.0, "a whole number, 1 or more"),
        (("observation", 0, "size"), 5, "a multiple of 3"),
        (("observation", 2, "name"), "past_actions", "observation[2].size is 3; accepted: a multiple of 4, as its"),
        (("observation", 1, "size"), 3, "4, as its frame"),
        (("observation", 0, "scale"), 0.0, "a positive number"),
        (("observation", 0, "scale"), math.inf, "a finite number"),
        (("observation",), EXAMPLE["observation"][:1], "exactly one attitude"),
        (("observation",), [EXAMPLE["observation"][1]] * 2, "different names"),
        (("memory_size",), -1, "a whole number, 0 or more"),
        (("memory_size",), 32.0, "a whole number, 0 or more"),
        (("action", "low"), [-0.1, -10.0, -10.0, -4.0], "collective thrust, is [-0.1, 27.3]; accepted: from 0 or more"),
        (("action", "low"), [9.9, -10.0, -10.0, -4.0], "below 9.81 m/s^2, to more than it, which hovers"),
        (("action", "high"), [9.7, 10.0, 10.0, 4.0], "is [0.0, 9.7]; accepted: from 0 or more, below 9.81 m/s^2"),
        (("action", "high"), [27.3, 10.0, 10.0, -4.0], "4 numbers below action.high"),
        (("action", "mode"), "rates", "'ctbr'"),
        (("action", "mode"), "velocity", "as action.mode is 'velocity'"),
        (("action", "units"), ["m/s^2", "deg/s", "deg/s", "deg/s"], "'rad/s'"),
        (("action", "low"), [0.0, -10.0, -10.0], "a list of 4 numbers"),
        (("action", "low"), [0.0, 10.0, -10.0, -4.0], "4 numbers below action.high"),
        (("action", "limits"), [0.0, 1.0], "[-1.0, 1.0]"),
        (("action", "mapping"), "command = high * action", "command = low"),
        (("hover_action",), [1.1, 0.0, 0.0, 0.0], "4 numbers in [-1, 1]"),
    ],
)
def test_a_value_out_of_range_is_refused(path: Path, value: Any, accepted: str) -> None:
    with pytest.raises(ValueError, match=re.escape(accepted)) as error:
        Contract.from_json(changed(path, value))
    assert str(path[0]) in str(error.value)


def test_another_version_is_named_before_its_other_keys() -> None:
    with pytest.raises(ValueError, match="contract_version is 7"):
        Contract.from_json('{"contract_version": 7, "anything": 1}')


@pytest.mark.parametrize("text", ["", "[]", "1", "null", '"x"', "{}", "[" * 100_000])
def test_what_is_no_contract_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match=r"^contract: .+"):
        Contract.from_json(text)


def test_a_key_that_is_there_twice_is_refused() -> None:
    with pytest.raises(ValueError, match="key 'task' is there twice"):
        Contract.from_json(json.dumps(EXAMPLE).replace('"task": "hover"', '"task": "race", "task": "hover"'))


def test_a_truncated_contract_is_refused() -> None:
    text = json.dumps(EXAMPLE)
    for length in range(len(text)):
        with pytest.raises(ValueError, match="not JSON"):
            Contract.from_json(text[:length])


def test_a_bad_contract_is_not_written() -> None:
    contract = dataclasses.replace(Contract.from_json(json.dumps(EXAMPLE)), latency_s=math.nan)
    with pytest.raises(ValueError, match="latency_s is nan"):
        contract.to_json()
