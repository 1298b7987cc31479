"""Exported pages in a real browser, from file://: they fly as Python does, and nothing leaves the machine."""

import dataclasses
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import jax
import numpy as np
import pytest
from playwright.sync_api import Browser, Page

from e2efly.config import EnvConfig, ImuConfig, RewardConfig, TaskConfig
from e2efly.control import COMMAND_MODES
from e2efly.environment import UNSEEN, Env, random_key
from e2efly.environment.episodes import Act, trace
from e2efly.policy.zoo import FOLDER
from e2efly.simulation.physics import INTEGRATORS
from e2efly.tasks import TASKS
from e2efly.tasks.hover import HoverConfig
from e2efly.validation.candidate import Candidate, candidate
from e2efly.validation.evaluation import SEED, act_of
from e2efly.vehicles.loading import vehicle_file
from e2efly.vehicles.vehicle import terms
from e2efly.viewing.watch.simulation import Hands, under
from e2efly.viewing.web.exported import STARTS, beginnings, course, still
from e2efly.viewing.web.page import write_page
from tests.browser import chromium
from tests.terms import VALUES

EXAMPLES = Path(__file__).parents[3] / "examples"
SECONDS = 5.0
ANY_TRACK = str(FOLDER / "vis_r" / "race_any.onnx")
POLICIES = ("hover", "land", "track", "race", "gap", "hover_aware", ANY_TRACK, "any/hover", "race_duel")
"""Every task by state, a policy without memory on any track, a policy for a family of vehicles, and a world of two."""


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with chromium() as started:
        yield started


@dataclasses.dataclass(frozen=True)
class Opened:
    """A page that is ready, with what it has complained of and asked for."""

    page: Page
    complaints: list[str]
    requests: list[str]

    def fly(self, **options: Any) -> dict[str, np.ndarray]:
        """Columns of a flight as fast as the machine computes, each (t, ...)."""
        rows = self.page.evaluate("async (options) => (await e2efly).fly(options)", options)
        return {name: np.array([row[name] for row in rows]) for name in rows[0]}


def opened(browser: Browser, folder: Path, search: str = "?paused") -> Opened:
    """Open a page and wait until it can fly; paused, so that drawing costs little."""
    page = browser.new_page(viewport={"width": 800, "height": 500})
    found = Opened(page, [], [])
    page.on("pageerror", lambda error: found.complaints.append(str(error)))
    page.on("console", lambda told: found.complaints.append(told.text) if told.type == "error" else None)
    page.on("request", lambda request: found.requests.append(request.url))
    page.goto(f"{folder.joinpath('index.html').as_uri()}{search}")
    page.evaluate("async () => { await e2efly; }")
    return found


@pytest.fixture(scope="module")
def racing(tmp_path_factory: pytest.TempPathFactory) -> tuple[Candidate, Path]:
    found, folder = candidate("race"), tmp_path_factory.mktemp("race")
    write_page(folder, found)
    return found, folder


@pytest.fixture(scope="module")
def race_page(racing: tuple[Candidate, Path], browser: Browser) -> Opened:
    return opened(browser, racing[1])


@pytest.mark.whole
@pytest.mark.parametrize("name", POLICIES)
def test_a_page_flies_as_python_does(name: str, browser: Browser, tmp_path: Path) -> None:
    found = candidate(name)
    write_page(tmp_path, found)
    open_page = opened(browser, tmp_path)
    memory_size, act = found.policy.contract.memory_size, act_of(found.policy)
    for number, suite in enumerate(found.task.criteria().values()):
        env = still(found.environment(suite))
        steps = round(SECONDS / env.control_period)
        states, _, _, out = trace(env, act, random_key(SEED, UNSEEN, 0), STARTS * env.agents, steps)
        for start in (0, STARTS - 1):
            world = slice(start * env.agents, (start + 1) * env.agents)
            flown = open_page.fly(course=number, start=start, seconds=SECONDS)
            away = np.linalg.norm(flown["position"] - states.position[:, world.start], axis=-1)
            assert away.max() < 1e-3, f"start {start}: {away.max()} m off"
            assert (flown["terminated"] == out.terminated[:, world].any(axis=1)).mean() > 0.99
            assert (flown["success"] == out.success[:, world].all(axis=1)).mean() > 0.99
            memory = np.zeros((1, memory_size), np.float32)
            for observation, action in zip(flown["observation"], flown["action"], strict=True):
                wanted, memory = found.policy.act(observation[None].astype(np.float32), memory=memory)
                np.testing.assert_allclose(action, wanted[0], rtol=0, atol=1e-5)
    assert open_page.complaints == []
    assert all(url.startswith("file://") for url in open_page.requests)
    open_page.page.close()


@pytest.mark.whole
def test_the_sliders_change_what_flies(racing: tuple[Candidate, Path], race_page: Opened) -> None:
    """To what the environment makes of the same wind, mass, thrust and delay."""
    found, open_page = racing[0], race_page
    nominal = open_page.fly(seconds=2)
    asked = {"wind": 6.0, "direction": 120.0, "mass": 1.3, "thrust": 1.2, "delay": 95.0}
    for name, value in asked.items():
        before = open_page.page.inner_text(f"#{name}-value")
        open_page.page.locator(f"#{name}").fill(str(value))
        assert open_page.page.inner_text(f"#{name}-value") != before
    flown = open_page.fly(seconds=2)
    angle = math.radians(asked["direction"])
    wind = asked["wind"] * np.array([math.cos(angle), math.sin(angle), 0.0])
    (suite,) = found.task.criteria().values()
    hands = Hands(wind.astype(np.float32), asked["mass"], asked["thrust"], asked["delay"] / 1e3)
    positions = disturbed_flight(still(found.environment(suite)), found, hands, steps=60)
    assert np.abs(flown["position"] - positions).max() < 1e-3
    assert np.linalg.norm(flown["position"] - nominal["position"], axis=-1).max() > 0.1
    open_page.page.locator("#nominal").click()
    np.testing.assert_array_equal(open_page.fly(seconds=2)["position"], nominal["position"])


def disturbed_flight(env: Env, found: Candidate, hands: Hands, steps: int) -> np.ndarray:
    """Positions (t, 3) of the first start, by the environment."""
    state = beginnings(env, STARTS)
    step = jax.jit(lambda env, state, action: env.step(under(env, state, hands), action, restart=False))
    observation, memory, places = env._observe(state), np.zeros((STARTS, found.policy.contract.memory_size)), []
    for _ in range(steps):
        action, memory = found.policy.act(np.asarray(observation), memory=memory.astype(np.float32))
        state, out = step(env, state, action)
        observation = out.final_observation
        places.append(np.asarray(state.vehicle.position[0]))
    return np.array(places)


@pytest.fixture(scope="module")
def odd_vehicle(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The VIS-R with every term that a file may leave out."""
    text = vehicle_file("vis_r").read_text()
    units = {f.name: f.metadata["unit"] for f in terms()}
    for name, value in VALUES.items():
        text += f'\n[{name}]\nvalue = {value}\nunit = "{units[name]}"\nsource = "a test"\n'
    path = tmp_path_factory.mktemp("vehicle") / "odd.toml"
    path.write_text(text)
    return path


def test_every_mode_and_integrator_is_tested() -> None:
    assert {mode for mode, _ in FLOWN} == set(COMMAND_MODES)
    assert {name for _, name in FLOWN} == set(INTEGRATORS)


FLOWN = (
    ("rotor_thrust", "rk4"),
    ("rotor_share", "rk3"),
    ("rotor_speed", "rk4"),
    ("ctbr", "rk4"),
    ("attitude", "rk3"),
    ("acceleration", "euler"),
    ("velocity", "rk3"),
    ("position", "semi_implicit"),
)


@pytest.mark.whole
@pytest.mark.parametrize(("mode", "integrator"), FLOWN)
def test_the_page_has_the_physics_of_every_vehicle(
    mode: str, integrator: str, odd_vehicle: Path, race_page: Opened
) -> None:
    """All command modes and integrators, all terms; the policy sees an IMU, and late."""
    config = EnvConfig(
        vehicle=str(odd_vehicle), command_mode=mode, integrator=integrator, observation_latency=(0.05, 0.05),
        imu=ImuConfig(observed=True, gyro_noise=0.0, accel_noise=0.0, gyro_bias=0.0, accel_bias=0.0),
    )  # fmt: skip
    env = still(Env.of(HoverConfig(), RewardConfig({"prog2": 1.0}), config))
    actions = np.random.default_rng(0).uniform(-0.4, 0.4, (30, 4)).astype(np.float32) + np.asarray(env.hover)
    flies_as_python_does(race_page, env, HoverConfig(), actions)


def test_every_world_of_a_task_is_tested() -> None:
    tested = {candidate(name).task.name for name in POLICIES} | set(STATED)
    assert {TASKS[name].world for name in tested} == {task.world for task in TASKS.values()}


STATED = (
    "avoid", "dodge", "hall", "hover_payload", "land_visual", "race_clutter", "race_speed", "avoid_together",
    "race_duel", "swap", "race_eyes",
)  # fmt: skip
"""Tasks of cameras and of loads, whose worlds fly without them, too, of random worlds, and of several vehicles."""


@pytest.mark.whole
@pytest.mark.parametrize("name", [*STATED, str(EXAMPLES / "06_own_task.py:OrbitConfig")])
def test_a_page_flies_any_task(name: str, race_page: Opened, monkeypatch: pytest.MonkeyPatch) -> None:
    """Also one from a file outside of the package."""
    monkeypatch.setattr(TASKS, "_known", dict(TASKS._known))
    task = TASKS.find(name)()
    env = still(Env.of(task, RewardConfig({"prog2": 1.0})))
    flies_as_python_does(race_page, env, task, np.tile(np.asarray(env.hover), (30, 1)))


def flies_as_python_does(page: Opened, env: Env, task: TaskConfig, actions: np.ndarray) -> None:
    """The first start, under given actions, which are those of all vehicles."""
    steps, agents = len(actions), env.agents
    about = {"courses": [course(env, task, starts=2)], "memory_size": 0}
    each = np.repeat(actions, agents, axis=0).tolist()
    flown = page.fly(numbers=about, actions=each, seconds=steps * env.control_period)
    states, _, _, out = trace(env, given(actions, 2 * agents), random_key(SEED, UNSEEN, 0), 2 * agents, steps)
    vehicles = [flown, *({name: np.array([row[i][name] for row in flown["others"]]) for name in flown["others"][0][i]}
                         for i in range(agents - 1))]  # fmt: skip
    for i, vehicle in enumerate(vehicles):
        for name in ("position", "velocity", "quaternion", "body_rate"):
            np.testing.assert_allclose(vehicle[name], getattr(states, name)[:, i], rtol=0, atol=5e-4, err_msg=name)
        np.testing.assert_allclose(vehicle["rotor_speed"], states.rotor_speed[:, i], rtol=1e-4)
        np.testing.assert_allclose(vehicle["observation"][1:], out.final_observation[:-1, i], rtol=0, atol=5e-3)
    for name in ("terminated", "truncated"):
        np.testing.assert_array_equal(flown[name], getattr(out, name)[:, :agents].any(1), err_msg=name)
    np.testing.assert_array_equal(flown["success"], out.success[:, :agents].all(1))
    np.testing.assert_allclose(flown["error"], out.error[:, 0], rtol=0, atol=1e-3)


def given(actions: np.ndarray, count: int) -> Act:
    """A policy whose actions are given; its memory counts."""
    return Act(lambda observation, images, memory: (np.tile(actions[int(memory[0])], (count, 1)), memory + 1), np.zeros)


@pytest.mark.whole
def test_a_page_is_flown_by_its_visitor(racing: tuple[Candidate, Path], browser: Browser) -> None:
    """Pause, throw, reset and another camera, by buttons and by keys; nothing is asked of the network."""
    page = (open_page := opened(browser, racing[1], "")).page

    def now() -> dict[str, Any]:
        return page.evaluate("async () => (await e2efly).now()")

    page.wait_for_function("parseFloat(document.getElementById('time').textContent) > 0.3")
    assert page.inner_text("#status") == "flying"
    page.locator("#camera").select_option("ride")
    page.locator("#pause").click()
    page.wait_for_function("document.getElementById('status').textContent === 'paused'")
    rested = now()
    page.locator("#throw").click()
    assert now()["time"] == rested["time"]
    assert math.dist(now()["velocity"], rested["velocity"]) > 0
    page.locator("#reset").click()
    assert now()["time"] == 0
    page.locator("#mass").fill("2")
    page.locator("#wind").fill("10")
    page.keyboard.press(" ")
    page.wait_for_function("async () => (await e2efly).now().time > 0.2")  # the panel may still tell of before
    page.wait_for_function("document.getElementById('status').textContent === 'flying'")
    page.keyboard.press(" ")
    page.wait_for_function("document.getElementById('status').textContent === 'paused'")
    watched = now()
    whole = open_page.fly(start=1, seconds=watched["time"])
    np.testing.assert_allclose(watched["position"], whole["position"][-1], rtol=0, atol=1e-9)
    still_air = {"wind": [0, 0, 0], "mass": 1}
    light = open_page.fly(start=1, seconds=watched["time"], conditions=still_air)
    assert math.dist(watched["velocity"], light["velocity"][-1]) > 0.1
    assert open_page.complaints == []
    assert all(url.startswith(("file://", "data:", "blob:")) for url in open_page.requests)
    page.close()


@pytest.mark.whole(but=1)
@pytest.mark.parametrize(("width", "scheme"), [(380, "dark"), (1200, "light")])
def test_a_page_fits_its_screen(width: int, scheme: Any, racing: tuple[Candidate, Path], browser: Browser) -> None:
    """A phone's, too: nothing is wider, everything that is there can be seen, and words stand out from their ground."""
    page = browser.new_page(viewport={"width": width, "height": 720}, color_scheme=scheme)
    page.goto(f"{racing[1].joinpath('index.html').as_uri()}?paused")
    page.evaluate("async () => { await e2efly; }")
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    boxes = {name: page.locator(name).bounding_box() for name in ("header", "#panel", "nav #throw", "nav #pause")}
    for name, box in boxes.items():
        assert box is not None, name
        assert box["x"] >= 0, name
        assert box["x"] + box["width"] <= width, name
        assert box["y"] + box["height"] <= 720, name
    ink, sky = (
        page.evaluate(f"getComputedStyle(document.body).{what}").strip("rgb()").split(",")
        for what in ("color", "backgroundColor")
    )
    assert abs(sum(map(float, ink)) - sum(map(float, sky))) > 3 * 120
    page.close()
