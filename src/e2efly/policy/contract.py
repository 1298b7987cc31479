"""The contract of an exported policy: what it sees, what it commands, and what it was trained for.

It is stored as JSON in the metadata of `policy.onnx` under the key `METADATA_KEY`. Imports no JAX and no simulator.
"""

import dataclasses
import json
from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate
from typing import Any

import numpy as np

from e2efly.config.domain import Domain, Extent, outside
from e2efly.config.storage import unique
from e2efly.control import COMMAND_MODES
from e2efly.control.modes import THRUST
from e2efly.policy import contract_json as read
from e2efly.policy.images import Image
from e2efly.policy.observation import OTHERS, PAST_ACTIONS, Company, Field, Own, own_fields
from e2efly.policy.zoo import contents
from e2efly.vehicles.family import OF_FRAMES, Ranges
from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.vehicle import ROTOR_COUNTS, Vehicle
from e2efly.vehicles.vehicle_domain import differences, misfits, vehicle_domain

CONTRACT_VERSION = 2
"""Version of the meaning of these fields; a policy of another version is refused."""
LARGEST = 1 << 20
"""Largest length of the JSON. The longest of the zoo has 3050 characters."""
METADATA_KEY = "contract"
"""Key of the contract in the metadata of the ONNX file."""
ACTION_LIMITS = (-1.0, 1.0)
"""Smallest and largest entry of an action. Values outside are clipped before the mapping to a command."""
ACTION_MAPPING = "command = low + (action + 1) / 2 * (high - low)"
"""Mapping from an action to a physical command, entry by entry."""
RATES = (0.1, 10_000.0)
"""Smallest and largest control rate, Hz."""
OPTIONAL = ("vehicles", "courses", "sensing", "others")
"""Fields that a contract may leave out: what its training did not declare."""
FRAMES = ("world", "body", "world_body", "none")
"""Frames of an observation field."""
SENSING = {
    "position_lag": "s", "velocity_lag": "s", "attitude_lag": "s", "body_rate_lag": "s", "pose_age": "s", "hold": "s",
    "dropped": "1",
}  # fmt: skip
"""Quantities of `Contract.sensing` with their units. NAME_lag: time constant of a first-order low-pass of a field of
the state, beyond the age of the pose. pose_age: time from the motion to the command that follows from it. hold: time
between two new states. dropped: share of the control steps without a new command."""


@dataclass(frozen=True)
class Action:
    """What the policy commands."""

    mode: str
    """A command mode: a name of `COMMAND_MODES`."""
    fields: tuple[str, ...]
    """Names of the commands: four, or one for each rotor in the modes of rotor thrusts."""
    units: tuple[str, ...]
    """Their units."""
    low: tuple[float, ...]
    """Command at action -1, in `units`. It is the smallest command that is ever sent."""
    high: tuple[float, ...]
    """Command at action +1, in `units`. It is the largest command that is ever sent."""
    limits: tuple[float, ...] = ACTION_LIMITS
    """Smallest and largest entry of an action."""
    mapping: str = ACTION_MAPPING
    """How an action becomes a command."""

    @property
    def command_range(self) -> tuple[tuple[float, float, float, float], tuple[float, float, float, float]] | None:
        """Smallest and largest command, in `units`, as `EnvConfig.command_range`. None: a command has not four numbers,
        and its limits are those of the vehicle's rotors.
        """
        if self.size != 4:
            return None
        (a, b, c, d), (e, f, g, h) = self.low, self.high
        return (a, b, c, d), (e, f, g, h)

    @property
    def size(self) -> int:
        """Number of entries of an action."""
        return len(self.fields)

    def command(self, action: np.ndarray) -> np.ndarray:
        """The commands for actions, (..., c) float64, by `mapping`. Actions are clipped to `limits`."""
        low, high = np.array(self.low), np.array(self.high)
        return low + (np.clip(np.asarray(action, np.float64), *ACTION_LIMITS) + 1) / 2 * (high - low)

    def asking(self, command: np.ndarray) -> np.ndarray:
        """The action that gives a command, (..., c), float32: the inverse of `mapping`, clipped to `limits`."""
        low, high = np.array(self.low), np.array(self.high)
        return np.clip(2 * (command - low) / (high - low) - 1, *ACTION_LIMITS).astype(np.float32)


@dataclass(frozen=True)
class Contract:
    """Everything on which a policy and the program that flies it must agree."""

    contract_version: int
    """`CONTRACT_VERSION`."""
    e2efly_version: str
    """Version of the package that exported it. It is shown to people, but not compared."""
    task: str
    """Name of the task."""
    vehicle: str
    """Name of the vehicle, or of the family of vehicles."""
    vehicle_hash: str | None
    """Hash of the vehicle's parameters: 16 hex digits. None, and no JSON key, if there are ranges instead."""
    control_rate_hz: float
    """Rate at which the policy is called, Hz."""
    latency_s: float
    """Latency from observation to command for which the policy is made, s: the vehicle's. If training used other
    latencies, their mean."""
    latency_range_s: tuple[float, ...]
    """Smallest and largest latency, s."""
    observation_latency_range_s: tuple[float, ...]
    """Smallest and largest age of the observed state in training, s."""
    observation: tuple[Field, ...]
    """The fields of the observation, in order."""
    images: tuple[Image, ...]
    """The images that the policy sees in addition, camera by camera."""
    memory_size: int
    """Number of values that it carries from one call to the next (the state of its GRU). 0: none."""
    action: Action
    """What it commands."""
    hover_action: tuple[float, ...]
    """The past actions that the policy is shown before its first action. They hover, if the command mode has a
    hover."""
    vehicle_ranges: Ranges | None = None
    """Ranges of the vehicles that it flies, for a family. None, and no JSON key, for a single vehicle, identified by
    the hash."""
    vehicles: Domain | None = None
    """For a single vehicle: the ranges of the vehicles that it was trained for, which lie about that vehicle
    (`e2efly.vehicles.vehicle_domain`). None, and no JSON key: not declared, or a family's."""
    courses: Domain | None = None
    """Ranges of the courses and worlds that it was trained for. None, and no JSON key: not declared."""
    sensing: Domain | None = None
    """Ranges of the lags, ages and holes of the observed state in training: the quantities of `SENSING`. None, and no
    JSON key: not declared, as in files of before."""
    others: Company | None = None
    """What it needs to know of other vehicles. None, and no JSON key: it observes none, or not declared, as in files of
    before."""

    def outside(self, courses: Domain) -> tuple[str, ...]:
        """The quantities in which courses lie outside of what it was trained for, in words. Empty: in none, or its
        training is not declared.
        """
        return outside(self.courses or (), courses)

    def refusals(self, vehicle: Vehicle | None = None, control_rate: float | None = None) -> tuple[str, ...]:
        """The reasons why the policy does not fly a (loaded) vehicle at a rate, Hz, in words. Empty: it does.

        It flies the vehicle that it was trained on, and all vehicles within the ranges of its training, with the
        delays of its training. What is None is not compared.
        """
        rate, reasons = self.control_rate_hz, list(() if vehicle is None else self.misfits(vehicle))
        if vehicle is not None and reasons:
            other = f"any/{self.task}" if not self.of_family and self.task in contents().get("any", {}) else ""
            reasons[-1] += (
                f"; what flies it is a policy that is trained for it, by `e2efly train {self.task} --vehicle FILE`"
                f"{f', or that of any vehicle, {other}' if other else ''}"
            )
        if control_rate is not None and not abs(control_rate - rate) <= 1e-6 * rate:  # true for NaN
            reasons.append(f"control_rate is {control_rate} Hz; accepted: {rate:g} Hz, at which the policy was trained")
        return tuple(reasons)

    def misfits(self, vehicle: Vehicle) -> tuple[str, ...]:
        """The quantities in which a vehicle lies outside of what the policy was trained for, in words."""
        if vehicle.hash == self.vehicle_hash:
            return ()
        if not self.domain:
            return (
                f"vehicle {vehicle.name!r} has hash {vehicle.hash}; accepted: {self.vehicle_hash}, that of "
                f"{self.vehicle!r} as the policy was trained on it",
            )
        delay = Extent("latency", "s", *self.latency_range_s)
        trained = *(part for part in self.domain if part.name != delay.name), delay
        return misfits(trained, self._measured(vehicle), vehicle.name, "" if self.of_family else self.vehicle)

    def differences(self, vehicle: Vehicle) -> tuple[str, ...]:
        """By how much a vehicle differs from the one that the policy was trained about, in words: a text for each
        quantity. Empty: it is that vehicle, or there is none, as for a family.
        """
        if self.of_family or vehicle.hash == self.vehicle_hash:
            return ()
        own = Extent("latency", "s", self.latency_s, self.latency_s)
        return differences((*self.domain, own), self._measured(vehicle), self.vehicle)

    @property
    def of_family(self) -> bool:
        """Whether it was trained for a family of vehicles rather than about a single one."""
        return self.vehicle_hash is None

    @property
    def domain(self) -> Domain:
        """The ranges of the vehicles that it was trained for, without the delay. Empty: not declared."""
        return (self.vehicles or ()) if self.vehicle_ranges is None else self.vehicle_ranges.domain

    def _measured(self, vehicle: Vehicle) -> Domain:
        """The quantities of a vehicle that its ranges are of, with its delay."""
        if self.vehicle_ranges is not None:
            return self.vehicle_ranges.domain_of(vehicle)
        late = float(vehicle.latency)
        return (*vehicle_domain(vehicle, self.action.mode), Extent("latency", "s", late, late))

    def latency_of(self, vehicle: Vehicle) -> float:
        """Latency from observation to command with which a vehicle flies, s. A vehicle of a family has its own."""
        return self.latency_s if self.vehicle_ranges is None else float(vehicle.latency)

    @cached_property
    def observation_size(self) -> int:
        """Number of entries of the observation."""
        return sum(field.size for field in self.observation)

    @cached_property
    def slices(self) -> dict[str, slice]:
        """The position of each field in the observation, by name, in order."""
        ends = list(accumulate(field.size for field in self.observation))
        return {f.name: slice(end - f.size, end) for f, end in zip(self.observation, ends, strict=True)}

    @cached_property
    def neighbours(self) -> int:
        """Number of other vehicles that it observes."""
        return sum(field.size for field in self.observation if field.name == OTHERS) // 3

    @cached_property
    def past_actions(self) -> int:
        """Number of its own last actions that it sees."""
        return sum(field.size for field in self.observation if field.name == PAST_ACTIONS) // self.action.size

    @cached_property
    def own(self) -> tuple[Own, ...]:
        """The vehicle's own fields that it sees, in the order of the table."""
        rows = own_fields(imu=True, actions=self.past_actions, size=self.action.size)
        return tuple(row for row in rows if row.field.name in self.slices)

    @property
    def sees_imu(self) -> bool:
        """Whether it sees measurements of an IMU."""
        return any(row.source == "imu" for row in self.own)

    @cached_property
    def attitude(self) -> str:
        """Name of the field that holds the attitude."""
        return next(field.name for field in self.observation if field.frame == "world_body")

    def to_json(self) -> str:
        """The contract as JSON.

        Raises:
            ValueError: for a contract that `from_json` would refuse.
        """
        left_out = {"vehicle_ranges" if self.vehicle_ranges is None else "vehicle_hash"}
        left_out |= {name for name in OPTIONAL if getattr(self, name) is None}
        content = {key: value for key, value in dataclasses.asdict(self).items() if key not in left_out}
        if self.vehicle_ranges is not None:
            content["vehicle_ranges"] = self.vehicle_ranges.given
        text = json.dumps(content, indent=2)
        Contract.from_json(text)
        return text

    @staticmethod
    def from_json(text: str) -> "Contract":
        """Read a contract, checking every value.

        Raises:
            ValueError: naming the field, the value and what is accepted.
        """
        if len(text) > LARGEST:
            raise ValueError(f"contract: has {len(text)} characters; accepted: at most {LARGEST}")
        try:
            content = json.loads(text, object_pairs_hook=unique)
        except (ValueError, RecursionError) as error:
            raise ValueError(f"contract: not JSON: {error}") from None
        if isinstance(content, dict) and "contract_version" in content:  # first: other versions have other keys
            version = content["contract_version"]
            if type(version) is not int or version != CONTRACT_VERSION:
                raise read.refusal("contract_version", version, f"{CONTRACT_VERSION}; export it again with this e2efly")
        if isinstance(content, dict):
            absent = "vehicle_hash" if "vehicle_ranges" in content else "vehicle_ranges"
            if absent in content:
                raise read.refusal(absent, content[absent], "one of vehicle_hash and vehicle_ranges, not both")
            content = dict.fromkeys(OPTIONAL) | content | {absent: None}
            if absent == "vehicle_hash" and content["vehicles"] is not None:
                raise read.refusal("vehicles", content["vehicles"], "left out, as vehicle_ranges say it")
        return _contract(read.table(content, "", Contract))


def _contract(x: dict[str, Any]) -> Contract:
    latency = read.seconds_range(x["latency_range_s"], "latency_range_s")
    latency_s = read.number(x["latency_s"], "latency_s")
    if not latency[0] <= latency_s <= latency[1]:
        raise read.refusal("latency_s", latency_s, f"a number of seconds within latency_range_s, {list(latency)}")
    rate = read.number(x["control_rate_hz"], "control_rate_hz")
    if not RATES[0] <= rate <= RATES[1]:
        raise read.refusal("control_rate_hz", rate, f"{RATES[0]:g} to {RATES[1]:g} Hz")
    vehicle_hash = None if x["vehicle_ranges"] is not None else read.text(x["vehicle_hash"], "vehicle_hash")
    if vehicle_hash is not None and (len(vehicle_hash) != 16 or set(vehicle_hash) - set("0123456789abcdef")):
        raise read.refusal("vehicle_hash", vehicle_hash, "16 hex digits in lower case")
    action = _action(x["action"])
    observation = _observation(x["observation"], action.size)
    hover = read.numbers(x["hover_action"], "hover_action", action.size)
    if not all(ACTION_LIMITS[0] <= value <= ACTION_LIMITS[1] for value in hover):
        raise read.refusal("hover_action", list(hover), f"{action.size} numbers in [-1, 1]")
    return Contract(
        contract_version=x["contract_version"],
        e2efly_version=read.text(x["e2efly_version"], "e2efly_version"),
        task=read.text(x["task"], "task"),
        vehicle=read.text(x["vehicle"], "vehicle"),
        vehicle_hash=vehicle_hash,
        control_rate_hz=rate,
        latency_s=latency_s,
        latency_range_s=latency,
        observation_latency_range_s=read.seconds_range(x["observation_latency_range_s"], "observation_latency_range_s"),
        observation=observation,
        images=_images(x["images"], rate),
        memory_size=read.whole(x["memory_size"], "memory_size", 0),
        action=action,
        hover_action=hover,
        vehicle_ranges=None if vehicle_hash is not None else _ranges(x["vehicle_ranges"]),
        **{name: None if x[name] is None else _domain(x[name], name) for name in ("vehicles", "courses")},
        sensing=None if x["sensing"] is None else _sensing(x["sensing"]),
        others=None if x["others"] is None else _company(x["others"], observation),
    )


def _sensing(value: Any) -> Domain:
    found = _domain(value, "sensing")
    for i, part in enumerate(found):
        read.one_of(part.name, f"sensing[{i}].name", SENSING)
        if part.unit != SENSING[part.name]:
            raise read.refusal(f"sensing[{i}].unit", part.unit, f"{SENSING[part.name]!r}, as its name is {part.name!r}")
        if part.low < 0:
            raise read.refusal(f"sensing[{i}].low", part.low, "0 or more")
    return found


def _company(value: Any, observation: tuple[Field, ...]) -> Company:
    x, known = read.table(value, "others", Company), {field.name: field.size for field in observation}
    count, shown = read.whole(x["count"], "others.count", 1), read.entries(x["fields"], "others.fields", None)
    fields = tuple(read.one_of(name, f"others.fields[{i}]", known) for i, name in enumerate(shown))
    if known.get(OTHERS, 0) != 3 * count:
        raise read.refusal("others.count", count, f"{known.get(OTHERS, 0) // 3}, as in the observation")
    numbers = {name: read.number(x[name], f"others.{name}") for name in ("max_age_s", "range_m", "speed_m_s")}
    for name, number in numbers.items():
        if number <= 0:
            raise read.refusal(f"others.{name}", number, "more than 0")
    return Company(count, fields, **numbers)


def _domain(value: Any, field: str) -> Domain:
    if not isinstance(value, list):
        raise read.refusal(field, value, "a list of ranges")
    found = []
    for i, entry in enumerate(value):
        where = f"{field}[{i}]"
        x = read.table(entry, where, Extent)
        name, unit = (read.text(x[key], f"{where}.{key}") for key in ("name", "unit"))
        low, high = (read.number(x[key], f"{where}.{key}") for key in ("low", "high"))
        if not (name.isascii() and name.isidentifier()) or name in (part.name for part in found):
            raise read.refusal(f"{where}.name", name, "a word of letters, digits and _, each once")
        if low > high:
            raise read.refusal(f"{where}.low", low, f"at most {where}.high, {high:g}")
        found.append(Extent(name, unit, low, high))
    return tuple(found)


def _ranges(value: Any) -> Ranges:
    known = dict.fromkeys(OF_FRAMES) | value if isinstance(value, dict) else value
    x = read.table(known, "vehicle_ranges", Ranges)
    bounds = {name: read.numbers(pair, f"vehicle_ranges.{name}", 2) for name, pair in x.items() if pair is not None}
    ranges = Ranges(**{name: (pair[0], pair[1]) for name, pair in bounds.items()})
    ranges.check("contract: vehicle_ranges")
    return ranges


def _observation(value: Any, action_size: int) -> tuple[Field, ...]:
    entries = read.entries(value, "observation", None)
    fields = tuple(_field(entry, f"observation[{i}]", action_size) for i, entry in enumerate(entries))
    names = [field.name for field in fields]
    if len(set(names)) != len(names):
        raise read.refusal("observation", names, "fields of different names")
    if sum(field.frame == "world_body" for field in fields) != 1:
        raise read.refusal("observation", names, "fields with exactly one attitude (frame 'world_body')")
    return fields


def _field(value: Any, where: str, action_size: int) -> Field:
    x = read.table(value, where, Field)
    size, frame = read.whole(x["size"], f"{where}.size", 1), read.one_of(x["frame"], f"{where}.frame", FRAMES)
    if (frame == "world" and size % 3) or (frame == "world_body" and size != 4):
        needed = "a multiple of 3, as its frame is 'world'" if frame == "world" else "4, as its frame is 'world_body'"
        raise read.refusal(f"{where}.size", size, needed)
    name, unit, text = (read.text(x[key], f"{where}.{key}") for key in ("name", "unit", "description"))
    if name == PAST_ACTIONS and size % action_size:
        raise read.refusal(f"{where}.size", size, f"a multiple of {action_size}, as its name is {name!r}")
    scale = read.number(x["scale"], f"{where}.scale")
    if scale <= 0:
        raise read.refusal(f"{where}.scale", scale, "a positive number")
    return Field(name, size, frame, unit, scale, text)


def _images(value: Any, rate: float) -> tuple[Image, ...]:
    if not isinstance(value, list):
        raise read.refusal("images", value, "a list of images, empty for a policy that sees none")
    images = tuple(Image.of_json(entry, f"images[{i}]") for i, entry in enumerate(value))
    names = [image.name for image in images]
    if len(set(names)) != len(names):
        raise read.refusal("images", names, "images of different names")
    for i, image in enumerate(images):
        if image.rate_hz > rate * (1 + 1e-6):
            raise read.refusal(f"images[{i}].rate_hz", image.rate_hz, f"at most control_rate_hz, {rate:g}")
    return images


def _action(value: Any) -> Action:
    x = read.table(value, "action", Action)
    mode = read.one_of(x["mode"], "action.mode", COMMAND_MODES)
    count = len(x["fields"]) if isinstance(x["fields"], list) else 0
    known = COMMAND_MODES[mode].of(count if count in ROTOR_COUNTS else 4)
    fields, units = known.fields, known.units
    for key, accepted in (("fields", fields), ("units", units)):
        if x[key] != list(accepted):
            raise read.refusal(f"action.{key}", x[key], f"{list(accepted)}, as action.mode is {mode!r}")
    if read.numbers(x["limits"], "action.limits", 2) != ACTION_LIMITS:
        raise read.refusal("action.limits", x["limits"], f"{list(ACTION_LIMITS)}")
    if x["mapping"] != ACTION_MAPPING:
        raise read.refusal("action.mapping", x["mapping"], repr(ACTION_MAPPING))
    low, high = (read.numbers(x[key], f"action.{key}", len(fields)) for key in ("low", "high"))
    if not all(a < b for a, b in zip(low, high, strict=True)):
        raise read.refusal("action.low", list(low), f"{len(fields)} numbers below action.high, {list(high)}")
    if fields[0] == THRUST and not 0 <= low[0] < GRAVITY < high[0]:
        accepted = f"from 0 or more, below {GRAVITY} m/s^2, to more than it, which hovers"
        raise read.refusal("action.low[0] to action.high[0], the collective thrust,", [low[0], high[0]], accepted)
    return Action(mode, fields, units, low, high)
