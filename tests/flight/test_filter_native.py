"""The filter's compiled formulas: the same numbers as Python's, to the last bit."""

import dataclasses
import math
from collections.abc import Iterator

import numpy as np
import pytest

from e2efly.control import Ctbr, Vec3
from e2efly.flight.filter import native
from e2efly.flight.filter.filter import Filter, FilterMemory, compiled, feel, filtered, forecast, remember, watch
from e2efly.flight.filter.forecast import ForecastCommand
from e2efly.flight.filter.guard import FilterError, keep
from e2efly.flight.settings import Fence
from e2efly.policy.odometry import Odometry
from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.loading import load_vehicle

VEHICLE = load_vehicle("vis_r")
FENCE = Fence(low=(-5.0, -5.0, 0.2), high=(5.0, 5.0, 6.0), speed=6.0, tilt=1.3)
HOVER = ForecastCommand(GRAVITY, 0.0, 0.0, 0.0)


def boxes(count: int) -> tuple[tuple[float, ...], ...]:
    """Boxes in a ring around the middle."""
    places = [(2.5 * math.cos(a), 2.5 * math.sin(a)) for a in np.linspace(0, math.tau, count, endpoint=False)]
    return tuple((x - 0.1, y - 0.1, 0.2, x + 0.1, y + 0.1, 4.0) for x, y in places)


def situations(count: int) -> Iterator[tuple[FilterMemory, Odometry, ForecastCommand]]:
    """Memory before the newest odometry, that odometry, and a wanted command."""
    random = np.random.default_rng(0)
    for _ in range(count):
        memory, now = FilterMemory(), 0.0
        for k in range(-20, 0):
            thrust, *rates = random.uniform([3.0, -4.0, -4.0, -1.0], [20.0, 4.0, 4.0, 1.0]).tolist()
            memory = remember(memory, ForecastCommand(thrust, *rates), k * 0.01)
            if k % 2 and random.uniform() < 0.8:
                memory = feel(memory, tuple(random.uniform(-3, 3, 3).tolist()), k * 0.01)
        q = np.array([3.0, *random.normal(size=3)])
        place, speed = random.uniform([-4.5, -4.5, 0.5], [4.5, 4.5, 5.5]), random.uniform(-3, 3, 3)
        seen = Odometry(now, place, speed, q / np.linalg.norm(q), random.uniform(-2, 2, 3))
        yield memory, seen, ForecastCommand(*random.uniform([3, -5, -5, -2], [25, 5, 5, 2]).tolist())


@pytest.mark.parametrize(
    ("tilt", "solids"),
    [(1.3, 0), (math.pi, 0), (1.3, 5), (1.3, native.SOLIDS + 4)],
    ids=["", "any tilt", "solids", "many"],
)
def test_the_compiled_filter_gives_the_same_numbers_to_the_last_bit(tilt: float, solids: int) -> None:
    plain = Filter.of(VEHICLE, dataclasses.replace(FENCE, tilt=tilt, solids=boxes(solids)), 0.09)
    fast, changed = compiled(plain), 0
    for memory, seen, wanted in situations(150):
        for floor in (True, False):
            both = [
                filtered(f, watch(f, memory, seen, 0.0, flying=True), seen, 0.0, wanted, floor=floor)
                for f in (plain, fast)
            ]
            assert both[0] == both[1]
            assert both[0].name == both[1].name
            changed += both[0].share > 0.0
    assert 30 < changed < 290


def test_numbers_that_are_not_finite_are_refused_by_the_compiled_filter() -> None:
    filter = compiled(Filter.of(VEHICLE, FENCE, 0.09))
    for memory, seen, _ in situations(3):
        for thrust, rate in ((math.nan, 0.0), (GRAVITY, math.inf), (GRAVITY, math.nan)):
            known = watch(filter, memory, seen, 0.0, flying=True)
            with pytest.raises(FilterError, match="finite"):
                keep(filter, known, seen, 0.0, Ctbr(thrust, Vec3(rate, 0.0, 0.0)))


def test_without_a_compiler_and_with_one_that_fails_it_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    filter = Filter.of(VEHICLE, FENCE)
    monkeypatch.setattr(native, "OPTIONS", ("--no-such-option",))
    with pytest.raises(OSError, match=r"cc ended with 1: .*no-such-option"):
        compiled(filter)
    monkeypatch.setenv("PATH", "")
    with pytest.raises(OSError, match="no C compiler 'cc' is on the path"):
        compiled(filter)


def test_a_branch_on_a_symbol_is_refused() -> None:
    function = native.TracedFunction("f", 2)
    a, b = function.inputs
    with pytest.raises(TypeError, match="`where`"):
        max(a, b)
    with pytest.raises(TypeError, match="`where`"):
        bool(a == b)


def test_a_reading_of_the_odometry_s_own_time_counts() -> None:
    memory, seen, _ = next(situations(1))
    filter = Filter.of(VEHICLE, FENCE, 0.09)
    known = watch(filter, dataclasses.replace(memory, felt=()), seen, 0.0, flying=True)
    read = feel(known, (1.0, 2.0, 3.0), math.nextafter(-0.09, 0.0))
    for of in (filter, compiled(filter)):
        assert forecast(of, read, seen, 0.0).wz != forecast(of, known, seen, 0.0).wz
