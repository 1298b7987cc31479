"""Programs of the page's machine compute what JAX computes, instruction by instruction, in a real browser."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from playwright.sync_api import Page

from e2efly.viewing.web.lowering import lowered
from e2efly.viewing.web.machine import DOT, ELEMENTWISE, LOOKUP
from tests.browser import chromium

MACHINE = Path(__file__).parents[3] / "web" / "src" / "machine.js"
WEIGHT = np.random.default_rng(1).normal(size=(7, 16)).astype(np.float32)

Arrays = dict[str, Any]
CASES: dict[str, Callable[[Arrays], Any]] = {
    "of one number": lambda g: [
        f(g["x"])
        for f in (
            jnp.negative, jnp.abs, jnp.sign, jnp.floor, jnp.ceil, jnp.round, jnp.trunc, jnp.cbrt, jnp.exp, jnp.exp2,
            jnp.expm1, jnp.sin, jnp.cos, jnp.tan, jnp.arctan, jnp.sinh, jnp.cosh, jnp.tanh, jnp.arcsinh, jnp.square,
            jax.nn.sigmoid, jnp.isfinite, jax.lax.round,
        )
    ],
    "of a positive number": lambda g: [
        f(1 + jnp.abs(g["x"])) for f in (jnp.sqrt, jax.lax.rsqrt, jnp.log, jnp.log1p, jnp.arccosh)
    ],
    "of a share": lambda g: [f(jnp.tanh(g["x"])) for f in (jnp.arcsin, jnp.arccos, jnp.arctanh)],
    "of two numbers": lambda g: [
        f(g["x"], g["y"])
        for f in (
            jnp.add, jnp.subtract, jnp.multiply, jnp.divide, jnp.maximum, jnp.minimum, jnp.arctan2, jnp.equal,
            jnp.not_equal, jnp.less, jnp.less_equal, jnp.greater, jnp.greater_equal, jax.lax.rem, jnp.hypot,
        )
    ],
    "powers": lambda g: [g["x"] ** 2, g["x"] ** 3, g["x"] ** -1, jnp.abs(g["x"]) ** g["y"]],
    "choices": lambda g: [
        jnp.where(g["x"] > 0, g["x"], g["y"]), jnp.clip(g["x"], -0.5, 0.5), jnp.where(jnp.isnan(g["x"]), 1, g["x"]),
        jax.lax.select_n(g["i"] % 3, g["x"][0, :3], g["y"][0, :3], g["x"][1, :3]),
        jax.lax.cond(g["x"][0, 0] > 0, jnp.sin, jnp.cos, g["y"]), jax.lax.switch(g["i"][0], [jnp.sin, jnp.cos], g["x"]),
    ],
    "truths": lambda g: [
        (g["x"] > 0) & (g["y"] > 0), (g["x"] > 0) | (g["y"] > 0), (g["x"] > 0) ^ (g["y"] > 0), ~(g["x"] > 0),
        jnp.any(g["x"] > 0, axis=1), jnp.all(g["x"] > 0, axis=0), (g["x"] > 0).astype(jnp.float32), g["i"] & 2,
    ],
    "whole numbers": lambda g: [
        g["x"].astype(int), g["i"] // 2, g["i"] % 3, jax.lax.div(-g["i"], jnp.int32(2)), g["i"].astype(bool),
    ],
    "sums": lambda g: [
        jnp.sum(g["x"]), jnp.sum(g["x"], axis=0), jnp.prod(g["x"], axis=1), jnp.max(g["x"], axis=1), jnp.min(g["x"]),
        jnp.mean(g["x"], axis=-1), jnp.argmax(g["x"], axis=1), jnp.argmin(g["x"], axis=0), jnp.linalg.norm(g["x"]),
        jnp.cumsum(g["x"], axis=1), jnp.cumprod(g["x"], axis=0), jax.lax.cumsum(g["x"], axis=1, reverse=True),
        jax.lax.cummax(g["x"], axis=1), jax.lax.cummin(g["x"], axis=1),
    ],
    "products": lambda g: [
        g["x"] @ WEIGHT, g["x"][:, :4] @ WEIGHT[:4, :2], g["x"] @ g["y"].T, WEIGHT.T @ g["x"][0],
        jnp.einsum("ij,ij->i", g["x"], g["y"]), jnp.einsum("ij,kj->ijk", g["x"], g["y"]), jnp.outer(g["x"][0], g["i"]),
    ],
    "shapes": lambda g: [
        g["x"].T, g["x"].reshape(7, 3), g["x"][::2, 1:5], g["x"][:, ::-1], jnp.concatenate([g["x"], g["y"]], axis=1),
        jnp.stack([g["x"], g["y"]], axis=1), *jnp.split(g["x"], [2, 3], axis=1), jnp.pad(g["x"], ((1, 0), (0, 2))),
        jnp.broadcast_to(g["x"][:, None], (3, 2, 7)), jnp.roll(g["x"], 2, axis=1), g["x"][:, np.array([3, 0, 3])],
        jnp.take_along_axis(g["x"], np.array([[1, 2], [0, 0], [6, 9]]), axis=1), jnp.zeros((0, 3)) + g["x"][0, 0],
    ],
    "indices": lambda g: [
        g["x"][g["i"][0]], g["x"][:, g["i"]], g["x"][g["i"] % 3, g["i"]], jnp.take(g["x"], g["i"], axis=1),
        jnp.take_along_axis(g["x"], g["i"][:, None] + 3, axis=1),
        jax.lax.dynamic_slice(g["x"], (g["i"][1], g["i"][2]), (1, 3)), g["x"].at[g["i"][2]].set(0.0),
        jax.lax.dynamic_update_slice(g["x"], g["y"][:1, :2], (g["i"][0], g["i"][1])), g["x"].at[0, g["i"][1]].set(9.0),
        g["x"].at[:, 2].set(1.0), g["x"].at[:, 2].add(1.0), g["x"].at[1, np.array([0, 3])].multiply(2.0),
        jax.nn.one_hot(g["i"], 5), jnp.asarray(WEIGHT)[g["i"][0], 2:4],
    ],
    "loops": lambda g: [
        jax.lax.scan(lambda s, x: (s + x, s * x), g["x"][0], g["y"]),
        jax.lax.scan(lambda s, x: (s - x, s), g["x"][0], g["y"], reverse=True),
        jax.lax.fori_loop(0, 5, lambda i, x: x * 0.5 + i, g["x"]),
        jax.checkpoint(jnp.sin)(g["x"]), jax.jvp(jnp.tanh, (g["x"],), (g["y"],)),
        jax.grad(lambda x: jnp.sum(x**3))(g["x"]),
    ],
}  # fmt: skip


@pytest.fixture(scope="module")
def page() -> Iterator[Page]:
    """A page that has the machine, and nothing else."""
    with chromium() as browser:
        page = browser.new_page()
        source = MACHINE.read_text(encoding="utf-8")
        page.add_script_tag(content=f"{source}\nglobalThis.e2efly = {{ machine, ELEMENTWISE }};", type="module")
        page.wait_for_function("globalThis.e2efly !== undefined")
        yield page


def test_the_machine_computes_what_jax_computes(page: Page) -> None:
    rng = np.random.default_rng(0)
    given = {name: rng.normal(size=(3, 7)).astype(np.float32) for name in "xy"}
    given["x"][0, :4], given["y"][2, 6] = (2.5, -0.5, 1.5, -3.0), given["x"][2, 6]
    given["i"] = np.array([1, 2, 4], np.int32)
    used = set()
    for case, function in CASES.items():

        def named(arrays: Arrays, function: Callable[[Arrays], Any] = function) -> Arrays:
            return {f"{i:03d}": x for i, x in enumerate(jax.tree.leaves(function(arrays)))}

        wanted = jax.jit(named)(given)
        program = lowered(named, given)
        used |= {row[0] for row in program["rows"]}
        numbers = {name: given[name].ravel().tolist() for name in program["inputs"]}
        found = page.evaluate("([program, given]) => e2efly.machine(program)(given)", [program, numbers])
        for name, value in wanted.items():
            what = f"{case}: number {int(name)} of the list"
            np.testing.assert_allclose(
                np.array(found[name], float), np.asarray(value, float).ravel(), rtol=2e-5, atol=2e-6, err_msg=what
            )
    assert used == ELEMENTWISE | {DOT, LOOKUP}, "an instruction that no case uses"
    assert set(page.evaluate("Object.keys(e2efly.ELEMENTWISE)")) == ELEMENTWISE
