"""Checks the frames of a flight's streams against each other: axes, their signs, order and meaning of the quaternions.

What the streams say about the same motion has to agree. Where it does not, remedies are tried, each of which stands
for one cause. The one with which everything agrees is named, or applied if no option can express it.
"""

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from itertools import permutations, product
from typing import NamedTuple

import numpy as np

from e2efly.alignment.comparison import at_times, attitudes, common_times, correlations, pearson, smooth, turning
from e2efly.control import Quat, Vec3
from e2efly.logs.recording import KINDS, Record, Stream
from e2efly.vehicles.gravity import GRAVITY

FIT, BETTER = 0.5, 0.25
"""`FIT`: lowest correlation, on each axis with enough motion, at which two streams agree. `BETTER`: a remedy that
leaves less than this share of what the streams disagree by shows that frames are wrong, even where the streams agree by
`FIT`."""
BETTER_HALF = 0.5
"""The same as `BETTER` for all axes together in each half of a flight."""
SMALL = 0.0005
"""Disagreement that shows nothing."""
ENOUGH = {"turn": 0.15, "steer": 0.15, "push": 0.3, "slide": 0.1}
"""Smallest motion that shows an axis, as a standard deviation: rad/s, rad/s, m/s^2, m/s."""
FAINT, CLEAR = 0.02, 0.9
"""Less motion than `ENOUGH`, by this factor, shows an axis if the correlation is as strong as `CLEAR`, whatever its
sign."""
BIAS = 0.5
"""Largest bias of an accelerometer that no frame has to explain, m/s^2."""
LEAST_S = 1.5
"""Length of the shortest flight whose frames are checked, s."""
ANSWER_S = 0.25
"""Within which body rates answer to commands, s."""
STEP, WIDTH = 0.02, 11
"""Time between the points at which frames are compared, s, and points over which streams are averaged: 0.2 s."""
SIMPLE, CERTAIN = 0.1, 0.02
"""`SIMPLE`: share of the disagreement that stays which each stream that a remedy changes, and its strangeness, has to
be worth: an axis that hardly moves shows nothing. `CERTAIN`: the disagreement that is at least reckoned with."""
RELATIONS = {
    "turn": {"body_rate", "quaternion"},
    "steer": {"body_rate"},
    "push": {"specific_force", "quaternion", "velocity", "position"},
    "weight": {"specific_force", "quaternion", "velocity", "position"},
    "up": {"specific_force"},
    "slide": {"velocity", "position"},
}
"""The streams of each comparison."""
TOLD = {
    "turn": ("body_rate", "the turning of quaternion", "body_rate", "quaternion"),
    "steer": ("body_rate", "the commanded body rates"),
    "push": ("specific_force", "the acceleration of the poses", "specific_force", "quaternion", "velocity"),
    "weight": ("specific_force", "gravity, turned by quaternion,"),
    "up": ("specific_force", "the thrust along body z"),
    "slide": ("velocity", "the change of position", "velocity", "position"),
}
"""What is compared, for people, and the streams without which it never is: where they are there, and nothing shows, the
notes say so."""

Values = Mapping[str, np.ndarray]
"""Streams by name, (n, k), all at the same times."""


class Misfit(NamedTuple):
    """How much two streams disagree."""

    worst: float
    """1 less the correlation of the axis that agrees least."""
    axes: int
    """Number of axes that are compared."""
    whole: float
    """1 less the correlation of all axes together, each by its motion."""

    @staticmethod
    def of(number: float) -> "Misfit":
        """Of a single number, which a sensor's bias changes: it finds no axes."""
        return Misfit(number, 1, 0.0)


NEVER = Misfit(np.inf, 0, np.inf)


@dataclass(frozen=True, eq=False)
class Remedy:
    """What makes our streams of those of a log."""

    what: str
    """What is wrong without it, for people."""
    maps: Mapping[str, np.ndarray] = field(default_factory=dict)
    """By stream, the matrix (k, k) that makes our entries of theirs."""
    turns: bool = False
    """Whether velocities are turned from the body into the world."""
    strange: int = 0
    """How unlikely it is: 0 for a convention, 1 for one mistake about axes, 2 for several."""
    weighs: bool = False
    """Whether gravity is added to the specific force."""

    @property
    def needs(self) -> set[str]:
        """The streams that it needs."""
        if self.turns or self.weighs:
            return {"velocity" if self.turns else "specific_force", "quaternion"}
        return set(self.maps)

    @property
    def columns(self) -> str:
        """The entries of `--columns` that do the same. Empty if there are none that do."""
        if not self.maps or any(np.any(np.abs(m).max(1) != np.abs(m).sum(1)) for m in self.maps.values()):
            return ""
        entries = []
        for name, m in self.maps.items():
            own = KINDS[name].columns
            for ours, row in zip(own, m, strict=True):
                theirs, sign = own[int(np.argmax(np.abs(row)))], "*-1" if row.sum() < 0 else ""
                entries += [f"{ours}={theirs}{sign}"] if (ours, "") != (theirs, sign) else []
        return " ".join(entries)

    def on(self, values: Values) -> Values:
        """The streams, remedied."""
        changed = {name: values[name] @ m.T for name, m in self.maps.items() if name in values}
        if self.turns:
            turned = Quat(*values["quaternion"].T).rotate(Vec3(*values["velocity"].T))
            changed["velocity"] = np.stack([turned.x, turned.y, turned.z], -1)
        if self.weighs:
            up = Quat(*values["quaternion"].T).unrotate(Vec3(0.0, 0.0, GRAVITY))
            changed["specific_force"] = values["specific_force"] + np.stack([up.x, up.y, up.z], -1)
        return {**values, **changed}


class Judgement(NamedTuple):
    """What the streams of a flight say about its frames."""

    usual: Mapping[str, Misfit]
    """By relation, as they are."""
    wrong: bool
    """Whether two of them do not agree."""
    best: Remedy | None
    """What makes all of them agree. None: nothing that is known, or nothing needs to."""


def judged_frames(part: Record) -> Judgement:
    """Compare the streams of a flight as they are, and as each remedy makes them."""
    values = _values(part)
    usual = _misfits(values)
    sure = {name for name in usual if name != "steer"}  # a vehicle need not do what it is told
    wrong = any(usual[name].worst > 1 - FIT for name in sure)
    best, least = None, np.inf
    if (
        not wrong
        and sum(usual[name].worst for name in sure) < SMALL
        and ("steer" not in usual or usual["steer"].worst < 1)
    ):
        return Judgement(usual, wrong, best)
    for remedy in _remedies():
        if remedy.needs <= set(values):
            new = {**usual, **_misfits(remedy.on(values), remedy.needs)}
            seen = _judges(usual, remedy)
            price = SIMPLE * max(sum(new[name].whole for name in seen), CERTAIN)
            left = sum(misfit.whole for misfit in new.values()) + price * (len(remedy.needs) + remedy.strange)
            fits = all(new[name].worst <= 1 - FIT for name in sure)
            if left < least and fits and (wrong or _helps(usual, new, seen, SMALL if seen <= sure else 1.0)):
                best, least = remedy, left
    if best is not None and not wrong and not all(_helped(half, best) for half in _halves(values)):
        best = None  # a wrong frame is wrong all the time, but wind, gusts and drag are not
    return Judgement(usual, wrong, best)


def _halves(values: Values) -> tuple[Values, Values]:
    """The first and the second half of a flight."""
    middle = len(next(iter(values.values()))) // 2
    return {k: v[:middle] for k, v in values.items()}, {k: v[middle:] for k, v in values.items()}


def _judges(usual: Mapping[str, Misfit], remedy: Remedy) -> set[str]:
    """The relations that judge a remedy. A vehicle need not do what it is told: that only counts where nothing else
    does.
    """
    changed = {name for name in usual if RELATIONS[name] & remedy.needs and name != "steer"}
    return changed or {"steer"} & set(usual)


def _helped(values: Values, remedy: Remedy) -> bool:
    """Whether a remedy brings streams that nearly agree nearer, or if there is too little motion to tell."""
    usual = _misfits(values)
    new = {**usual, **_misfits(remedy.on(values), remedy.needs)}
    seen = _judges(usual, remedy)
    return sum(new[name].whole for name in seen) < max(BETTER_HALF * sum(usual[name].whole for name in seen), SMALL)


def in_one_frame(record: Record, part: Record) -> Record:
    """The flight in our frames: as it is, or corrected where `--columns` cannot do it, which its notes say. `part` is
    what of it is compared: in the air, where no blow from the ground disturbs.

    Raises:
        ValueError: naming the two streams that do not agree, and what makes them agree.
    """
    usual, wrong, best = judged_frames(part)
    blind = [
        f"{one} cannot be checked against {other}: there is too little motion"
        for name, (one, other, *needed) in TOLD.items()
        if needed and record.has(*needed) and name not in usual
    ]
    blind += [
        f"{one} can be checked against {other} on {usual[name].axes} of 3 axes: there is too little motion on the rest"
        for name, (one, other, *needed) in TOLD.items()
        if needed and name in usual and usual[name].axes < 3
    ]
    record = replace(record, notes=(*record.notes, *blind))
    if best is None and not wrong:
        return record
    at = max(usual, key=lambda name: usual[name].worst)
    one, other, *_ = TOLD[at]
    problem = f"{one} does not agree with {other} (by {1 - usual[at].worst:.2f}, where 1 is the same)"
    if best is None:
        some = " or ".join(f"--without {name}" for name in sorted(RELATIONS[at] & set(record.streams)))
        raise ValueError(
            f"{record.path}: {problem}, whatever the order of the axes and their signs; accepted: streams of one "
            f"flight, or the log {some}"
        )
    if best.weighs:
        raise ValueError(
            f"{record.path}: {problem}: it looks like {best.what}; accepted: {KINDS['specific_force'].what}, or the "
            "log --without specific_force"
        )
    if best.columns:
        raise ValueError(
            f"{record.path}: {problem}; it does if {best.what}; accepted: "
            f"{'; '.join(f'{name}: {KINDS[name].what}' for name in best.maps)} (--columns {best.columns}, in a CSV "
            "file with its own names behind the =)"
        )
    note = f"{problem}: it does if {best.what}, which is corrected"
    return replace(_remedied(record, best), notes=(*record.notes, note))


def _helps(usual: Mapping[str, Misfit], new: Mapping[str, Misfit], seen: Collection[str], least: float) -> bool:
    """Whether a remedy leaves little of what two streams disagreed by, and nothing else disagrees more for it."""
    kept = all(new[name].axes >= usual[name].axes and new[name].worst < usual[name].worst + least for name in seen)
    return kept and any(
        usual[name].worst - new[name].worst > least and new[name].worst < BETTER * usual[name].worst for name in seen
    )


def _remedied(record: Record, remedy: Remedy) -> Record:
    streams = dict(record.streams)
    for name, m in remedy.maps.items():
        streams[name] = Stream(streams[name].time, streams[name].values @ m.T)
    if remedy.turns:
        stream = streams["velocity"]
        both = {"velocity": stream.values, "quaternion": attitudes(streams["quaternion"], stream.time)}
        streams["velocity"] = Stream(stream.time, remedy.on(both)["velocity"])
    return replace(record, streams=streams)


def _values(record: Record) -> Values:
    """The streams that are compared at common times, averaged over 0.2 s."""
    names = [n for n in ("position", "velocity", "quaternion", "body_rate", "specific_force") if record.has(n)]
    if not names:
        return {}
    asked = next((n for n in ("command", "setpoint") if record.has(n)), "")
    time = common_times(record, *names, step=STEP)
    gaps = [s for n in names for s in _gaps(record.streams[n])]
    pieces = np.split(time, np.searchsorted(time, sorted(end for _, end in gaps)))
    time = max(([t for t in piece if not any(a < t < b for a, b in gaps)] for piece in pieces), key=len)
    if len(time) * STEP < LEAST_S:
        return {}
    time = np.array(time)
    values = {
        n: attitudes(record.streams[n], time) if n == "quaternion" else at_times(record.streams[n], time) for n in names
    }
    if asked:
        values["asked"] = at_times(record.streams[asked], time)[:, -3:]
    return values


def _gaps(stream: Stream) -> list[tuple[float, float]]:
    """Beginning and end of each gap over which nothing can be averaged, s."""
    long = np.flatnonzero(np.diff(stream.time) > 0.7 * WIDTH * STEP)
    return list(zip(stream.time[long], stream.time[long + 1], strict=True))


def _misfits(values: Values, changed: Collection[str] = tuple(KINDS)) -> dict[str, Misfit]:
    """By relation that the flight shows, of those that any of the changed streams is part of."""
    found = dict[str, Misfit]()
    asked = {name for name, streams in RELATIONS.items() if streams & set(changed)}
    gyro, q, force, velocity, position = (
        values.get(n) for n in ("body_rate", "quaternion", "specific_force", "velocity", "position")
    )

    def compare(name: str, one: np.ndarray, other: np.ndarray, late: int = 0) -> None:
        moves = one.std(0) if name == "push" else np.maximum(one.std(0), other.std(0))
        moves = moves / ENOUGH[name]
        for k in range(late + 1):
            seen = correlations(one[k:], other[: len(other) - k])
            told = seen[(moves > 1) | ((moves > FAINT) & (np.abs(seen) > CLEAR))]
            if len(told) and 1 - told.min() < found.get(name, NEVER).worst:
                a, b = (x - x.mean(0) for x in (one[k:], other[: len(other) - k]))
                whole = pearson(a.ravel(), b.ravel())
                found[name] = Misfit(1 - float(told.min()), len(told), 1 - whole)

    if "turn" in asked and gyro is not None and q is not None:
        compare("turn", _averaged(gyro), _averaged(turning(q, STEP)))
    if "steer" in asked and gyro is not None and "asked" in values:
        compare("steer", _averaged(gyro), _averaged(values["asked"]), round(ANSWER_S / STEP))
    if "slide" in asked and velocity is not None and position is not None:
        compare("slide", _averaged(velocity), np.gradient(_averaged(position), STEP, axis=0))
    if "up" in asked and force is not None:
        size = float(np.median(np.linalg.norm(force, axis=1)))
        found["up"] = Misfit.of(1 - float(np.median(force[:, 2])) / max(size, 1e-9))
    moved = velocity
    if velocity is None and position is not None:
        moved = np.gradient(position, STEP, axis=0)
    if "push" in asked and force is not None and q is not None and moved is not None:
        turned = Quat(*q.T).rotate(Vec3(*force.T))
        felt = _averaged(np.stack([turned.x, turned.y, turned.z], -1)) - np.array([0.0, 0.0, GRAVITY])
        acceleration = np.gradient(_averaged(moved), STEP, axis=0)
        if velocity is None:  # the noise of positions, differentiated twice, hides what averages show
            felt, acceleration = _averaged(felt), _averaged(acceleration)
        inner = Quat(*q[(len(q) - len(felt)) // 2 :][: len(felt)].T)
        away = inner.unrotate(Vec3(*(felt - acceleration).T)).stack().mean(0)
        felt = felt - inner.rotate(Vec3(*np.clip(away, -BIAS, BIAS))).stack()
        compare("push", felt, acceleration)
        found["weight"] = Misfit.of(min(float(abs(np.mean(felt - acceleration, 0)[2])) / GRAVITY, 2.0))
    return found


def _averaged(x: np.ndarray) -> np.ndarray:
    """Without the edges, where there is nothing to average over."""
    return smooth(x, WIDTH)[WIDTH:-WIDTH]


def _signed(n: int = 3) -> Iterator[np.ndarray]:
    """All orders of axes with all signs, (n, n), the usual one left out."""
    for order, signs in product(permutations(range(n)), product((1.0, -1.0), repeat=n)):
        m = np.zeros((n, n))
        m[range(n), order] = signs
        if not np.array_equal(m, np.eye(n)):
            yield m


FRD = np.diag([1.0, -1.0, -1.0])
NED = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
WORLD = np.array([[0.0, -1, -1, 0], [1, 0, 0, 1], [1, 0, 0, -1], [0, -1, 1, 0]]) * np.sqrt(0.5)
"""Matrix of (0, 1, 1, 0) / sqrt 2 times a quaternion: a world NED becomes ENU."""
BODY = np.array([[0.0, -1, 0, 0], [1, 0, 0, 0], [0, 0, 0, 1], [0, 0, -1, 0]])
"""Matrix of a quaternion times (0, 1, 0, 0): a body FRD becomes FLU."""
ORDER = np.eye(4)[[3, 0, 1, 2]]
CONJUGATE = np.diag([1.0, -1.0, -1.0, -1.0])


def _strangeness(m: np.ndarray, usual: np.ndarray) -> int:
    """How unlikely axes are, as `Remedy.strange`."""
    if np.array_equal(m, usual):
        return 0
    return 1 if np.linalg.det(m) > 0 or np.trace(m) == 1 else 2  # turned, or one axis negated, or two swapped


@cache
def _remedies() -> tuple[Remedy, ...]:
    """All remedies. Each stands for one cause; those that explain more by one convention come first."""
    orders = {
        "": np.eye(4),
        "are xyzw": ORDER,
        "are world to body": CONJUGATE,
        "are xyzw, world to body": CONJUGATE @ ORDER,
    }
    frames = {
        "": np.eye(4),
        "are of the body's axes FRD": BODY,
        "are of a world NED": WORLD,
        "are of a world NED and a body FRD": WORLD @ BODY,
    }
    found = []
    for (order, first), (frame, then) in product(orders.items(), frames.items()):
        what = f"quaternions {' and '.join(x for x in (order, frame) if x)}"
        q = {"quaternion": then @ first}
        if order or frame:
            found.append(Remedy(what, q))
        if "NED" in frame:
            world = {"position": NED, "velocity": NED}
            found.append(Remedy(f"{what}, as position and velocity", q | world))
            found += [Remedy(f"{what}, as {name}", q | {name: NED}) for name in world]
    both = {"body_rate": FRD, "specific_force": FRD}
    world = {"position": NED, "velocity": NED, "quaternion": WORLD @ BODY}
    for some in (
        world,
        {k: world[k] for k in ("position", "quaternion")},
        {k: world[k] for k in ("velocity", "quaternion")},
        {"quaternion": WORLD @ BODY},
    ):
        found.append(Remedy("the world is NED and the body FRD, for all of them", some | both))
    found.append(Remedy("velocities are in the body's axes", turns=True))
    found.append(Remedy("values without gravity", weighs=True))
    for names in (
        ("body_rate",),
        ("specific_force",),
        ("body_rate", "specific_force"),
        ("position",),
        ("velocity",),
        ("position", "velocity"),
    ):
        for m in _signed():
            usual = FRD if names[0] in ("body_rate", "specific_force") else NED
            axes = (
                "axes and signs are others"
                if not np.array_equal(m, usual)
                else "the axes are FRD"
                if usual is FRD
                else "the world is NED"
            )
            found.append(
                Remedy(f"{axes} in {' and '.join(names)}", dict.fromkeys(names, m), strange=_strangeness(m, usual))
            )
    return tuple(found)
