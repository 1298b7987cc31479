"""Curricula: stages of a run whose environments differ only in numbers, so that nothing has to be compiled again."""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import jax
import numpy as np

from e2efly.config import StageConfig, TaskConfig, check_fields
from e2efly.environment import Env


@dataclass(frozen=True)
class CurriculumStage:
    """The environment that is trained on until the promotion, and the environments that decide about the promotion."""

    env: Env
    judges: dict[str, Env]
    """The environments of the evaluation, by the name of their criterion."""
    config: StageConfig | None
    """Configuration of the stage. None: the last stage, which is the task itself."""

    def is_over(self, success: float, steps: int) -> bool:
        """Whether this stage ends and the next one begins.

        Args:
            success: success rate of the last evaluation in this stage.
            steps: environment steps since the stage began.
        """
        if self.config is None:
            return False
        enough = self.config.success is not None and success >= self.config.success
        return enough or (self.config.steps is not None and steps >= self.config.steps)


def stages(env: Env, task: TaskConfig, curriculum: Sequence[StageConfig] = ()) -> tuple[CurriculumStage, ...]:
    """The stages of a run: those of the curriculum, then the task itself, which `env` was built for.

    Raises:
        ValueError: naming the stage, its value and what is accepted.
    """
    last = _stage(env, task, None)
    shape = _shape(last)
    found = []
    for i, stage in enumerate(curriculum):
        where = f"curriculum[{i}]"
        if stage.success is None and stage.steps is None:
            raise ValueError(f"{where} has neither success nor steps; accepted: at least one of them, to end it")
        check_fields(where, stage)
        easier: Any = task
        for path, value in stage.changes.items():
            easier = changed(easier, path, value, where)
        found.append(_stage(env.eased(stage.strength).on(easier), easier, stage))
        if _shape(found[-1]) != shape:
            raise ValueError(
                f"{where}.changes has {', '.join(stage.changes)}; accepted: numbers that do not set shapes or the "
                "program (those whose help does not say so)"
            )
    return (*found, last)


def changed(config: Any, path: str, value: Any, where: str) -> Any:
    """A configuration with another value at a dotted path.

    Raises:
        ValueError: when there is no such field, or when its value has another type or shape.
    """
    name, _, rest = path.partition(".")
    fields = getattr(config, "__dataclass_fields__", {})
    if name not in fields:
        raise ValueError(f"{where}.changes: no field {name!r}; accepted: {', '.join(fields) or 'no field below it'}")
    old = getattr(config, name)
    if rest:
        return dataclasses.replace(config, **{name: changed(old, rest, value, where)})
    value = tuple(value) if isinstance(value, list) else value
    if isinstance(old, str) or np.shape(value) != np.shape(old) or isinstance(value, str):
        raise ValueError(f"{where}.changes: {name} is {value!r}; accepted: a value like {old!r}")
    return dataclasses.replace(config, **{name: value})


def _stage(env: Env, task: TaskConfig, stage: StageConfig | None) -> CurriculumStage:
    return CurriculumStage(env, {name: env.on(suite) for name, suite in task.criteria().items()}, stage)


def _shape(stage: CurriculumStage) -> Any:
    """The structure, shapes and types that decide which program runs."""
    leaves, structure = jax.tree.flatten((stage.env, list(stage.judges.values())))
    return structure, [(np.shape(x), np.asarray(x).dtype) for x in leaves]
