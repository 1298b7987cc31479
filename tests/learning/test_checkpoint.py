"""Checkpoints are whole or refused."""

import math
import multiprocessing
import os
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from e2efly.config.storage import write_atomically
from e2efly.environment import random_key
from e2efly.learning.checkpoint import load_checkpoint, read_about, save_checkpoint

TREE = {"a": np.arange(6, dtype=np.float32).reshape(2, 3), "b": [jnp.int32(4), random_key(7)]}


@pytest.fixture
def path(tmp_path: Path) -> Path:
    path = tmp_path / "checkpoint.safetensors"
    save_checkpoint(path, TREE, {"update": 3})
    return path


def test_a_tree_comes_back_bit_for_bit(path: Path) -> None:
    back = load_checkpoint(path, TREE)
    np.testing.assert_array_equal(back["a"], TREE["a"])
    assert back["b"][0] == 4
    np.testing.assert_array_equal(jax.random.key_data(back["b"][1]), jax.random.key_data(random_key(7)))
    assert read_about(path)["update"] == 3


@pytest.mark.parametrize("kept", [0, 5, 40, 200])
def test_a_truncated_file_is_refused(path: Path, kept: int) -> None:
    path.write_bytes(path.read_bytes()[:kept])
    with pytest.raises(ValueError, match="truncated or damaged"):
        load_checkpoint(path, TREE)


def test_a_flipped_bit_is_refused(path: Path) -> None:
    data = bytearray(path.read_bytes())
    data[-3] ^= 1
    path.write_bytes(data)
    with pytest.raises(ValueError, match="checksum"):
        load_checkpoint(path, TREE)


def test_another_shape_is_refused_by_name(path: Path) -> None:
    with pytest.raises(ValueError, match=r"\['a'\].*accepted: float32\[4, 3\]"):
        load_checkpoint(path, {**TREE, "a": np.zeros((4, 3), np.float32)})


def test_a_missing_and_a_surplus_part_are_refused(path: Path) -> None:
    with pytest.raises(ValueError, match=r"\['c'\] is missing"):
        load_checkpoint(path, {**TREE, "c": np.zeros(1)})
    with pytest.raises(ValueError, match="belong to no part"):
        load_checkpoint(path, {"a": TREE["a"]})


def test_what_it_says_is_json_though_a_score_is_infinite(tmp_path: Path) -> None:
    save_checkpoint(tmp_path / "file", TREE, {"best_score": -math.inf})
    assert b"Infinity" not in (tmp_path / "file").read_bytes()
    assert read_about(tmp_path / "file")["best_score"] is None


def test_a_failed_write_leaves_the_old_file(tmp_path: Path) -> None:
    path = tmp_path / "file"
    write_atomically(path, b"old")
    (tmp_path / f"file.{os.getpid()}.part").mkdir()
    with pytest.raises(OSError):
        write_atomically(path, b"new")
    assert path.read_bytes() == b"old"


def write_often(path: Path, letter: bytes) -> None:
    for _ in range(200):
        write_atomically(path, 10_000 * letter)


def test_processes_that_write_the_same_file_do_not_meet(tmp_path: Path) -> None:
    path, context = tmp_path / "file", multiprocessing.get_context("spawn")
    writers = [context.Process(target=write_often, args=(path, letter)) for letter in (b"a", b"b")]
    for writer in writers:
        writer.start()
    for writer in writers:
        writer.join()
    assert [writer.exitcode for writer in writers] == [0, 0]
    assert path.read_bytes() in (10_000 * b"a", 10_000 * b"b")
    assert list(tmp_path.iterdir()) == [path]
