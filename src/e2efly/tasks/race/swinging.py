"""Gates that swing sideways: where they are at a time. Imports no JAX.

A gate's centre is at its place on the track plus `cosine` cos(`rate` t) + `sine` sin(`rate` t), to the gate's left. It
swings in its own plane, so that its plane stands still and its opening moves.
"""

import dataclasses
from dataclasses import dataclass
from typing import Any

from e2efly.control.vectors import Array, namespace
from e2efly.courses.gates import Gates


@dataclass(frozen=True)
class SwingingMemory:
    """How far each vehicle is, and how its gates swing."""

    passed: Array
    """(n,) number of gates passed."""
    cosine: Array
    """(n, g) m."""
    sine: Array
    """(n, g) m."""
    rate: Array
    """(n, g) rad/s."""
    time: Array
    """(n,) time at the end of the last step, s."""

    def offsets(self, time: Array) -> Array:
        """(n, g) how far to their left the gates are at a time, m."""
        xp, angle = namespace(self.rate), self.rate * time[:, None]
        return self.cosine * xp.cos(angle) + self.sine * xp.sin(angle)


def passed_by(memory: Any) -> Array:
    """(n,) number of gates passed: the task's state itself, unless gates swing."""
    return memory.passed if isinstance(memory, SwingingMemory) else memory


def after_step(memory: Any, passed: Array, time: Array) -> Any:
    """The task's state after a step that ended at a time, in which a gate was passed or not, (n,)."""
    if isinstance(memory, SwingingMemory):
        return dataclasses.replace(memory, passed=memory.passed + passed, time=time)
    return memory + passed


def gates_at(gates: Gates, memory: Any, closed: bool, time: Array | None = None) -> Gates:
    """The gates at a time, each array of centres (n, g + 1, 3), and how far they have moved since the last step.

    Without a time: at the end of the last step. Gates that stand still are returned as they are.
    """
    if not isinstance(memory, SwingingMemory):
        return gates
    xp = namespace(memory.rate)
    left = xp.stack([-xp.asarray(gates.sin), xp.asarray(gates.cos), 0.0 * xp.asarray(gates.cos)], axis=-1)

    def placed(when: Array) -> Array:
        moved = memory.offsets(when)[..., None] * left
        last = moved[:, :1] if closed else 0.0 * moved[:, :1]  # a closed track's first gate again
        return xp.concatenate([moved, last], axis=1)

    before = placed(memory.time)
    now = before if time is None else placed(time)
    return dataclasses.replace(gates, position=xp.asarray(gates.position) + now, moved=now - before)


def rows(table: Array, index: Array) -> Array:
    """Rows of a table (g, c), or of one for each vehicle, (n, g, c), by their numbers, (n,) or (n, k)."""
    if table.ndim == 2:
        return table[index]
    chosen = index.reshape(index.shape[0], -1, 1)
    found = namespace(table).take_along_axis(table, chosen, axis=1)
    return found.reshape(*index.shape, table.shape[-1])
