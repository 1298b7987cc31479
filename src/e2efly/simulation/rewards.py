"""The paper's reward manual: one pure function per term, batched over leading axes.

Every term is unweighted. Its sign is such that its weight is positive: the reward of a step is the sum of weight times
term. The argument names of a term are its inputs; `reward` finds them among the signals of the step and the parameters
of the configuration. Terms are tagged: `differentiable`, `partly` (differentiable between jumps) or `sparse` (an event;
first-order methods drop its gradient, which is zero anyway).

The equation names are those of the E2E-Fly paper, section Reward Design. Where the paper contradicts itself, the
docstring says what we do; docs/rewards.md has the table.
"""

import inspect
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Literal, TypeVar

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from e2efly.config.names import unknown
from e2efly.config.registry import Registry
from e2efly.control.vectors import safe_sqrt

F = TypeVar("F", bound=Callable[..., Array])
Scalar = Float[Array, "*n"]
Vector = Float[Array, "*n 3"]


def norm(v: Float[Array, "*n k"]) -> Scalar:
    """Euclidean length over the last axis; gradient 0 at zero."""
    return safe_sqrt(jnp.sum(v * v, axis=-1))


def prog1(offset: Vector, previous_offset: Vector) -> Scalar:
    """Distance to the goal gained in this step, m (Eq. prog1; signed: the paper's norm also rewards moving away)."""
    return norm(previous_offset) - norm(offset)


def prog2(offset: Vector) -> Scalar:
    """Minus the distance to the goal, m (Eq. prog2)."""
    return -norm(offset)


def progxy(offset: Vector) -> Scalar:
    """Minus the horizontal distance to the goal, m (Eq. prog3)."""
    return -norm(offset[..., :2])


def progx(offset: Vector) -> Scalar:
    """Minus the distance to the goal along world x, m (Eq. prog4)."""
    return -jnp.abs(offset[..., 0])


def progy(offset: Vector) -> Scalar:
    """Minus the distance to the goal along world y, m (Eq. prog5)."""
    return -jnp.abs(offset[..., 1])


def progz(offset: Vector) -> Scalar:
    """Minus the distance to the goal along world z, m (Eq. prog6)."""
    return -jnp.abs(offset[..., 2])


def progway(way: Scalar, previous_way: Scalar) -> Scalar:
    """Progress in this step along a way to the goal that may be curved, m. Ours."""
    return previous_way - way


def act1(action: Float[Array, "*n c"]) -> Scalar:
    """Minus the length of the action (Eq. act1, with the sign of act3)."""
    return -norm(action)


def act2(action: Float[Array, "*n c"], previous_action: Float[Array, "*n c"]) -> Scalar:
    """Minus the length of the change of the action (Eq. act2, with the sign of act3)."""
    return -norm(action - previous_action)


def act3(
    action: Float[Array, "*n c"],
    previous_action: Float[Array, "*n c"],
    act3_size: float | Array = 0.025,
    act3_change: float | Array = 0.002,
) -> Scalar:
    """act1 and act2 together: -(lambda7 |u| + lambda8 |u - u'|), the paper's racing values as defaults (Eq. act3)."""
    return act3_size * act1(action) + act3_change * act2(action, previous_action)


def ori1(yaw_error: Scalar) -> Scalar:
    """exp(-|yaw error|), rad (Eq. ori1; the angle is absolute, otherwise one direction would be rewarded)."""
    return jnp.exp(-jnp.abs(yaw_error))


def ori2(quaternion: Float[Array, "*n 4"], desired_quaternion: Float[Array, "*n 4"]) -> Scalar:
    """Minus the distance of the quaternion to the desired one (Eq. ori2). The nearer of q and -q counts.

    Both are the same attitude.
    """
    inner = jnp.sum(quaternion * desired_quaternion, axis=-1, keepdims=True)
    return -norm(quaternion - jnp.where(inner < 0, -1.0, 1.0) * desired_quaternion)


def ori3(pixel: Float[Array, "*n 2"], pixel_velocity: Float[Array, "*n 2"]) -> Scalar:
    """exp(-(u^2 + v^2 + u'^2 + v'^2)): keep the target still in the middle of the image (Eq. ori3)."""
    return jnp.exp(-jnp.sum(pixel**2, axis=-1) - jnp.sum(pixel_velocity**2, axis=-1))


def ori4(roll_error: Scalar, approaching: Bool[Array, "*n"], ori4_limit: float | Array = 2.0) -> Scalar:
    """-min(tan|roll error|, lambda12) while approaching a gap, else 0 (Eq. ori4); limited beyond a right angle, too."""
    angle = jnp.abs(roll_error)
    bounded = jnp.minimum(angle, jnp.arctan(ori4_limit))
    return jnp.where(approaching, -jnp.tan(bounded), 0.0)


def v1(velocity: Vector) -> Scalar:
    """Minus the speed, m/s (Eq. linearv1)."""
    return -norm(velocity)


def v2(velocity: Vector, desired_speed: Scalar | float = 1.0) -> Scalar:
    """-(speed - v_d) (Eq. linearv2, as written: the reward for being slow has no bound)."""
    return -(norm(velocity) - desired_speed)


def v3(velocity: Vector, desired_speed: Scalar | float = 1.0) -> Scalar:
    """-(exp(speed - v_d) + 1) (Eq. linearv3, as written: the constant stays)."""
    return -(jnp.exp(norm(velocity) - desired_speed) + 1.0)


def descent_speed(
    height: Scalar, vz_slope: float | Array = 1.0, vz_min: float | Array = 0.2, vz_max: float | Array = 1.0
) -> Scalar:
    """Desired speed of descent at a height: clamp(alpha height, min, max), m/s (Eq. linearvz)."""
    return jnp.clip(vz_slope * height, vz_min, vz_max)


def vz(
    velocity: Vector,
    height: Scalar,
    vz_slope: float | Array = 1.0,
    vz_min: float | Array = 0.2,
    vz_max: float | Array = 1.0,
) -> Scalar:
    """1 / (1 + |v_h + v_z|): 1 at the desired speed of descent (Eq. linearv4)."""
    return 1.0 / (1.0 + jnp.abs(descent_speed(height, vz_slope, vz_min, vz_max) + velocity[..., 2]))


def anglev(body_rate: Vector) -> Scalar:
    """Minus the body rate, rad/s (Eq. anglev)."""
    return -norm(body_rate)


def avoid1(clearance: Scalar, avoid1_offset: float | Array = 0.1) -> Scalar:
    """-1 / (d + b) (Eq. avoid1; negative, because the paper's sign rewards being near)."""
    return -1.0 / (jnp.maximum(clearance, 0.0) + avoid1_offset)


def avoid2(
    clearance: Scalar,
    approach_speed: Scalar,
    avoid2_radius: float | Array = 0.12,
    avoid2_barrier: float | Array = 0.1,
    avoid2_steepness: float | Array = 32.0,
) -> Scalar:
    """-|v_c| (max(1 - (d - r), 0)^2 + lambda19 softplus(-lambda20 (d - r))), v_c >= 0 only while approaching.

    Eq. avoid2, with two changes. The softplus falls with distance, while the paper's grows. It is inside the scaling by
    the approach speed, as the paper's text says. The steepness 32 is that of DiffPhysDrone.
    """
    gap = clearance - avoid2_radius
    near = jnp.maximum(1.0 - gap, 0.0) ** 2 + avoid2_barrier * jax.nn.softplus(-avoid2_steepness * gap)
    return -jnp.maximum(approach_speed, 0.0) * near


def vel(velocity: Vector, desired_velocity: Vector) -> Scalar:
    """Minus the velocity error relative to the desired speed, which counts as at least 1 m/s. Ours."""
    return -norm(velocity - desired_velocity) / jnp.maximum(norm(desired_velocity), 1.0)


def overspeed(velocity: Vector, desired_speed: Scalar | float = 1.0) -> Scalar:
    """-relu(speed - v_d)^2, (m/s)^2: only excess speed is penalised. Ours."""
    return -(jnp.maximum(norm(velocity) - desired_speed, 0.0) ** 2)


def avoid(
    gaps: Float[Array, "*n k"],
    closing: Float[Array, "*n k"],
    avoid_reach: float | Array = 0.8,
    avoid_barrier: float | Array = 0.5,
    avoid_steepness: float | Array = 16.0,
) -> Scalar:
    """Sum over things in reach: -(relu(reach - d)^2 + barrier softplus(-k d)) (1 + v), v the closing speed, m/s. Ours.

    The gradient passes through the distances only. The sum, instead of the nearest thing alone, gives a gap between two
    things a middle.
    """
    speed = jax.lax.stop_gradient(jnp.maximum(closing, 0.0))
    near = jnp.maximum(avoid_reach - gaps, 0.0) ** 2 + avoid_barrier * jax.nn.softplus(-avoid_steepness * gaps)
    return -jnp.sum(near * (1 + speed), axis=-1)


def apart(misses: Float[Array, "*n k"], apart_reach: float | Array = 0.6) -> Scalar:
    """Minus the sum of relu(reach - m)^2 over other vehicles, m the gap at the closest approach to come, m. Ours.

    The gradient passes through positions and velocities: it turns a vehicle away before the other is near.
    """
    return -jnp.sum(jnp.maximum(apart_reach - misses, 0.0) ** 2, axis=-1)


def goal(arrived: Bool[Array, "*n"]) -> Scalar:
    """1 in the step that reaches a goal (Eq. goal)."""
    return arrived.astype(jnp.float32)


def crash(crashed: Bool[Array, "*n"]) -> Scalar:
    """-1 in the step that crashes (Eq. collision)."""
    return -crashed.astype(jnp.float32)


def near(offset: Vector, near_steepness: float | Array = 8.0) -> Scalar:
    """exp(-d) + exp(-k d) / 2: steep near the goal and flat far away. Ours, for PPO; not in the paper."""
    d = norm(offset)
    return jnp.exp(-d) + 0.5 * jnp.exp(-near_steepness * d)


def alive(height: Scalar) -> Scalar:
    """1 in every step. Not in the paper; its authors' public environments have it (docs/paper.md)."""
    return jnp.ones_like(height)


def anglev_sq(body_rate: Vector) -> Scalar:
    """Minus the squared body rate, (rad/s)^2: smooth at zero. Ours."""
    return -jnp.sum(body_rate**2, axis=-1)


def anglevxy_sq(body_rate: Vector) -> Scalar:
    """Minus the squared body rate about body x and y, (rad/s)^2: the vehicle may spin about its own axis. Ours."""
    return -jnp.sum(body_rate[..., :2] ** 2, axis=-1)


def act2_sq(action: Float[Array, "*n c"], previous_action: Float[Array, "*n c"]) -> Scalar:
    """Minus the squared change of the action: smooth at zero. Ours."""
    return -jnp.sum((action - previous_action) ** 2, axis=-1)


def descent(
    velocity: Vector,
    height: Scalar,
    offset: Vector,
    vz_slope: float | Array = 1.0,
    vz_min: float | Array = 0.2,
    vz_max: float | Array = 1.0,
    descent_cone: float | Array = 0.3,
) -> Scalar:
    """-|v_h s + v_z|, m/s: vz's desired descent, slowed by s = 1 / (1 + (d_xy / cone)^2) until centred. Ours."""
    centred = 1.0 / (1.0 + jnp.sum(offset[..., :2] ** 2, axis=-1) / descent_cone**2)
    return -jnp.abs(descent_speed(height, vz_slope, vz_min, vz_max) * centred + velocity[..., 2])


def imitate(
    action: Float[Array, "*n c"], expert_action: Float[Array, "*n c"], imitate_rounding: float | Array = 0.05
) -> Scalar:
    """Minus the distance to an expert's action, summed over its entries: sqrt(e^2 + r^2) - r. Ours.

    The expert acts in the states that the policy reaches (DAgger, Ross et al. 2011). It knows the world that the policy
    only sees. For tasks that have an expert, such as `avoid`, and for policies that command thrust and body rates.
    """
    error, r = action - expert_action, imitate_rounding
    return -jnp.sum(jnp.sqrt(error**2 + r**2) - r, axis=-1)


def upright(quaternion: Float[Array, "*n 4"]) -> Scalar:
    """-(1 - cos tilt): level is 0, upside down is -2; any heading. Ours."""
    return -2.0 * (quaternion[..., 1] ** 2 + quaternion[..., 2] ** 2)


def fit(overhang: Float[Array, "*n k"], fit_margin: float | Array = 0.02, fit_limit: float | Array = 0.1) -> Scalar:
    """Minus how far parts of the vehicle extend beyond the opening that they pass, shrunk by a margin, m. Ours.

    Beyond the limit, the penalty does not grow: being beside the opening is not worse than turning back.
    """
    return -jnp.sum(jnp.clip(overhang + fit_margin, 0.0, fit_limit), axis=-1)


def fitlog(
    overhang: Float[Array, "*n k"], fitlog_margin: float | Array = 0.1, fitlog_scale: float | Array = 0.02
) -> Scalar:
    """-log(1 + o / scale), o how far parts extend beyond the opening shrunk by a margin, m: steep near fitting. Ours.

    A part that extends far is still penalised more than one that extends less, but never so much that turning back is
    better.
    """
    out = jnp.maximum(overhang + fitlog_margin, 0.0)
    return -jnp.sum(jnp.log1p(out / fitlog_scale), axis=-1)


Kind = Literal["differentiable", "partly", "sparse"]


@dataclass(frozen=True)
class Term:
    """A reward term: its function, and to what extent it can be differentiated."""

    function: Callable[..., Array]
    kind: Kind

    @property
    def inputs(self) -> list[str]:
        """The signals that the term needs."""
        parameters = inspect.signature(self.function).parameters.values()
        return [p.name for p in parameters if p.default is inspect.Parameter.empty]

    @property
    def parameters(self) -> dict[str, float]:
        """The constants that a configuration may set, with their defaults."""
        parameters = inspect.signature(self.function).parameters.values()
        return {p.name: p.default for p in parameters if p.default is not inspect.Parameter.empty}


_KINDS: dict[Kind, tuple[Callable[..., Array], ...]] = {
    "differentiable": (
        prog1, prog2, progxy, progx, progy, progz, act1, act2, act3, ori1, ori3, v1, v2, v3, anglev, near,
        anglev_sq, anglevxy_sq, act2_sq, upright, imitate, vel, overspeed, progway, alive,
    ),
    "partly": (ori2, ori4, vz, avoid1, avoid2, avoid, apart, descent, fit, fitlog),
    "sparse": (goal, crash),
}  # fmt: skip
TERMS: Registry[Term] = Registry("reward term", source=lambda term: term.function)
"""Every term by name."""


def register(kind: Kind) -> Callable[[F], F]:
    """Register a term under its function's name.

    Args:
        kind: `differentiable`, `partly` or `sparse`; see the head of this module.

    Raises:
        ValueError: for another kind, or for a name that another function already has.
    """
    if kind not in _KINDS:
        raise ValueError(f"kind of a reward term is {kind!r}; accepted: {', '.join(_KINDS)}")

    def registered(function: F) -> F:
        TERMS.add(function.__name__, Term(function, kind))
        return function

    return registered


for _kind, _functions in _KINDS.items():
    for _function in _functions:
        register(_kind)(_function)


GROUPS: dict[str, tuple[str, ...]] = {
    "prog": ("prog1", "prog2", "progxy", "progx", "progy", "progz", "progway", "near"),
    "act": ("act1", "act2", "act3", "act2_sq"),
    "ori": ("ori1", "ori2", "ori3", "ori4", "upright"),
    "v": ("v1", "v2", "v3", "vz", "descent", "vel", "overspeed"),
    "anglev": ("anglev", "anglev_sq"),
    "avoid": ("avoid1", "avoid2", "avoid", "apart"),
    "sparse": ("goal", "crash"),
}
"""The parts of a reward that the paper's ablations remove, with their terms. Our terms are in the part that they belong
to."""


def grouped(terms: Iterable[str]) -> dict[str, tuple[str, ...]]:
    """The paper's parts that a reward has, with its terms of each part. A term that is in no part forms its own."""
    of = {term: group for group, members in GROUPS.items() for term in members}
    found: dict[str, tuple[str, ...]] = {}
    for term in terms:
        group = of.get(term, term)
        found[group] = (*found.get(group, ()), term)
    return found


def constants() -> set[str]:
    """The constants of all terms."""
    return {name for term in TERMS.values() for name in term.parameters}


def check(weights: Mapping[str, float], parameters: Mapping[str, float]) -> None:
    """Check the names of a reward's terms and parameters.

    Raises:
        ValueError: naming the unknown name, the nearest name and all known names. A term of the user's own may be a
            reference, `path/to/file.py:Name`. Also for two names of one term.
    """
    functions = [TERMS.find(name).function for name in weights]
    if twice := next((f.__name__ for f in functions if functions.count(f) > 1), None):
        raise ValueError(f"reward term {twice!r} is given by two names, {', '.join(weights)}; accepted: one weight")
    for name in parameters:
        if name not in (known := constants()):
            raise ValueError(unknown("reward parameter", name, known))


def reward(
    weights: Mapping[str, float | Array], parameters: Mapping[str, float | Array], signals: Mapping[str, Array]
) -> tuple[Scalar, dict[str, Scalar]]:
    """The weighted sum of the terms, and each weighted term.

    Weights are array leaves, so that changing one does not recompile. `parameters` are constants of the terms that
    differ from their defaults.

    Raises:
        ValueError: when a term needs a signal that the task does not have.
    """
    terms = {}
    for name, weight in weights.items():
        term = TERMS.find(name)
        if missing := [i for i in term.inputs if i not in signals]:
            raise ValueError(f"reward term {name!r} needs {', '.join(missing)}, which this task does not have")
        given = {**parameters, **signals}
        constants = {p: given[p] for p in term.parameters if p in given}
        value = term.function(**{i: signals[i] for i in term.inputs}, **constants)
        terms[term.function.__name__] = weight * (jax.lax.stop_gradient(value) if term.kind == "sparse" else value)
    return jnp.sum(jnp.stack(list(terms.values())), axis=0), terms
