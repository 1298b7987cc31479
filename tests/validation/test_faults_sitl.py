"""Faults against the real firmware: every one ends in its safe state, in time, and its log can be read."""

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from e2efly.policy.loader import load_policy
from e2efly.tasks.hover.goal import HoverRoute
from e2efly.tasks.route import course_for
from e2efly.validation import firmware_program
from e2efly.validation.rig import Rig
from e2efly.vehicles.loading import load_vehicle
from tests.faults import process_faults
from tests.faults.fault_run import Outcome, strike
from tests.faults.faults import FAULTS, End, Fault
from tests.faults.stage import LATENCY_S, TARGET, Stage


class Hangar:
    """One rig for all faults; where one has left it unfit, the next gets a new one."""

    def __init__(self, policy: Path, folder: Path) -> None:
        self.policy, self.folder = load_policy(policy), folder
        self._open = ExitStack()
        self._stage: Stage | None = None
        self._count = 0

    def strike(self, fault: Fault) -> Outcome:
        stage, self._stage = self._stage or self._build(), None
        self._count += 1
        outcome = strike(stage, fault, self.folder / f"{self._count}.mcap")
        # after a fall the poses have jumped, and the bridge waits for a new track: another vehicle flies on
        self._stage = None if outcome.problems or fault.end is End.FALLS else stage
        return outcome

    def close(self) -> None:
        self._open.close()

    def _build(self) -> Stage:
        self._open.close()
        vehicle = load_vehicle("vis_r")
        goal = course_for(self.policy.contract, vehicle, HoverRoute(target=TARGET))
        folder = self.folder / f"firmware{self._count}"
        rig = self._open.enter_context(Rig(firmware_program.chosen(), folder, vehicle, latency=LATENCY_S))
        stage = Stage(rig, self.policy, goal)
        self._open.callback(stage.close)
        stage.fly(0.3)
        return stage


@pytest.fixture(scope="module")
def hangar(policy_of: Callable[..., Path], tmp_path_factory: pytest.TempPathFactory) -> Iterator[Hangar]:
    hangar = Hangar(policy_of("hover"), tmp_path_factory.mktemp("faults"))
    yield hangar
    hangar.close()


@pytest.mark.whole(but=1)
@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name.replace(" ", "-"))
def test_it_ends_as_documented(hangar: Hangar, fault: Fault) -> None:
    assert hangar.strike(fault).problems == ()


def test_all_of_them_are_documented() -> None:
    text = (Path(__file__).parents[2] / "docs" / "faults.md").read_text(encoding="utf-8")
    missing = [fault.name for fault in FAULTS if f"| {fault.name} |" not in text]
    missing += [name for name in process_faults.FAULTS if f"| bridge: {name} |" not in text]
    assert missing == []
