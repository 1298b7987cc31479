"""Damaged logs of every format are read as far as they are whole, or refused by name: no other error, no hang."""

import random
from pathlib import Path

import pytest

from e2efly.logs.readers import read_flights
from tests.logs.log_samples import SAMPLES, TOKENS, bytes_of
from tests.mutations import Endured, mutated


@pytest.fixture(scope="module")
def samples(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    return bytes_of(tmp_path_factory.mktemp("samples"))


@pytest.mark.parametrize("name", SAMPLES)
def test_damaged_logs_are_read_or_refused_by_name(tmp_path: Path, samples: dict[str, bytes], name: str) -> None:
    rng, endured, others = random.Random(name), Endured(), list(samples.values())
    for _ in range(100):
        endured.attempt(read_flights, tmp_path / "log", mutated(samples[name], rng, others, TOKENS))
    assert endured.faults == []
    assert endured.read > 5 and endured.refused > 5
