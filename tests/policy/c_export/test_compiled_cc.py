"""A policy as C is the policy: compiled without a warning, and compared with the file that it was made from."""

import dataclasses
import subprocess
from pathlib import Path

import numpy as np
import onnx
import pytest

from e2efly.commands.cli import run
from e2efly.config import NetworkConfig
from e2efly.environment import random_key
from e2efly.environment.episodes import Act, run_stepwise
from e2efly.learning.networks import Features
from e2efly.learning.onnx_export import write_policy
from e2efly.learning.onnx_layers import perceptron_graph
from e2efly.policy.c_export.c_source import sources
from e2efly.policy.c_export.exact import Exact
from e2efly.policy.c_export.header import Sizes, field_name, header, image_name
from e2efly.policy.c_export.write import write_c
from e2efly.policy.contract import Contract
from e2efly.policy.loader import Policy, load_policy
from e2efly.policy.random_inputs import random_images, random_observations
from e2efly.policy.zoo import contents, policy_file
from e2efly.validation.candidate import candidate
from e2efly.validation.evaluation import act_of
from tests.learning.test_export_images import CONVOLVED, DEPTH, MASK, POOLED, RGB, exported
from tests.policy.c_export.compiled import STRICT, Compiled, build, compiled, compiler

KINDS = ("race_any", "hover", "any/race", "avoid", "land_visual", "race_clutter")
"""A policy without memory, with a memory, of a family, and those that see: depth as it is, a mask, depth in cells."""


def inputs(policy: Policy, count: int) -> tuple[np.ndarray, list[np.ndarray], np.ndarray]:
    """Observations, images and memories by chance."""
    c, rng = policy.contract, np.random.default_rng(1)
    images = [random_images(rng, image, count) for image in c.images]
    memory = rng.uniform(-1, 1, (count, c.memory_size)).astype(np.float32)
    return random_observations(rng, c.observation, count), images, memory


def both(
    made: Compiled, observation: np.ndarray, images: list[np.ndarray], memory: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Actions and next memories of the C, row by row."""
    actions, after = np.empty((len(observation), made.contract.action.size)), np.empty(memory.shape)
    for k, row in enumerate(observation):
        made.memory[:] = memory[k]
        status, actions[k] = made.network(row, [x[k] for x in images])
        assert status == 0
        after[k] = made.memory
    return actions, after


def check_exact(policy: Policy, made: Compiled, file: Path, count: int) -> tuple[tuple, tuple]:
    """Whether actions and memories are the exact ones within 1e-6; inputs and what came of them."""
    given = inputs(policy, count)
    wanted, found = Exact(policy.contract, file.read_bytes()).act(*given), both(made, *given)
    for a, b in zip(found, wanted, strict=True):
        np.testing.assert_allclose(a, b, rtol=0, atol=1e-6)
    return given, found


def without_past(contract: Contract, observation: np.ndarray) -> np.ndarray:
    """What is seen beside the past actions."""
    past = contract.slices["past_actions"]
    return np.delete(observation, np.arange(past.start, past.stop), axis=-1)


@pytest.mark.whole(but=1)
@pytest.mark.parametrize("name", KINDS)
def test_each_kind_of_policy_is_the_same_within_1e_6(name: str, tmp_path: Path) -> None:
    """Of its exact value: ONNX Runtime's own actions are up to 3e-6 from that."""
    file = policy_file(name)
    policy, made = load_policy(file), compiled(file, tmp_path)
    given, found = check_exact(policy, made, file, 300)
    if name in ("hover", "land_visual"):  # whose ONNX Runtime is within 1e-6, too
        np.testing.assert_allclose(found[0], policy.act(*given)[0], rtol=0, atol=1e-6)


@pytest.mark.whole(but=1)
@pytest.mark.parametrize("name", KINDS)
def test_in_single_precision_it_is_as_near_as_onnx_runtime(name: str, tmp_path: Path) -> None:
    file = policy_file(name)
    policy, made = load_policy(file), compiled(file, tmp_path, "float", "-O2", "-Wdouble-promotion")
    given = inputs(policy, 300)
    wanted, _ = Exact(policy.contract, file.read_bytes()).act(*given)
    rounding = np.abs(policy.act(*given)[0] - wanted).max()
    assert np.abs(both(made, *given)[0] - wanted).max() <= 2 * rounding < 1e-5


@pytest.mark.whole(but=1)
@pytest.mark.parametrize("name", ["hover", "avoid"])
def test_over_real_flights_it_acts_as_the_file_from_its_own_memory(name: str, tmp_path: Path) -> None:
    """Observations and images are those of a flight by the file; the memory goes on in the C itself."""
    file, seen = policy_file(name), list[tuple[np.ndarray, list[np.ndarray], np.ndarray]]()
    found = candidate(file)
    env, by_file = found.environment(next(iter(found.task.criteria().values()))), act_of(found.policy)

    def act(observation: np.ndarray, images: tuple, memory: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        action, after = by_file.act(observation, images, memory)
        seen.append((observation[0].copy(), [np.array(x[0]) for x in images], action[0]))
        return action, after

    steps = 60
    run_stepwise(env, Act(act, by_file.begin), random_key(0), 1, steps, 0.0)
    assert len(seen) == steps
    made = compiled(file, tmp_path)
    made.begin()
    exact, memory = Exact(found.policy.contract, file.read_bytes()), np.zeros((1, found.policy.contract.memory_size))
    for observation, images, of_file in seen:
        status, action = made.network(observation, images)
        wanted, memory = exact.act(observation[None], [x[None] for x in images], memory)
        assert status == 0
        np.testing.assert_allclose(action, wanted[0], rtol=0, atol=1e-6)
        np.testing.assert_allclose(action, of_file, rtol=0, atol=1e-5)


@pytest.mark.parametrize(
    ("cameras", "network"),
    [
        ((dataclasses.replace(DEPTH, encoding="linear"),), dataclasses.replace(POOLED, activation="tanh")),
        ((dataclasses.replace(DEPTH, encoding="log"),), POOLED),
        ((RGB,), POOLED),
        ((MASK,), POOLED),
        ((MASK, RGB), dataclasses.replace(CONVOLVED, recurrent=7)),
        ((dataclasses.replace(RGB, sees="normal"), DEPTH), NetworkConfig((7, 5), "elu", pool=(4, 4), encoder=(6,))),
    ],
    ids=["linear-tanh", "log", "rgb", "mask", "convolved-gru", "normal-depth-elu"],
)
def test_all_that_a_training_can_export(cameras: tuple, network: NetworkConfig, tmp_path: Path) -> None:
    file, *_ = exported(tmp_path, cameras, network)
    policy, made = load_policy(file), compiled(file, tmp_path)
    check_exact(policy, made, file, 50)


@pytest.mark.parametrize("operator", ["Softplus", "LeakyRelu", "Sigmoid", "Identity"])
def test_what_other_frameworks_have_learned(operator: str, tmp_path: Path) -> None:
    """Another activation, normalisation of the observation, actions that are clipped."""
    rng, about = np.random.default_rng(0), load_policy("race_any").contract
    size = about.observation_size
    layers = [
        (rng.normal(size=(a, b)).astype(np.float32), rng.normal(size=b).astype(np.float32))
        for a, b in ((size, 6), (6, 4))
    ]
    normal = rng.normal(size=size), rng.uniform(1, 2, size), 2.0
    graph = perceptron_graph(Features(about.observation), layers, [operator, "Identity"], True, normal)
    write_policy(tmp_path / "policy.onnx", graph, about)
    policy, made = load_policy(tmp_path / "policy.onnx"), compiled(tmp_path / "policy.onnx", tmp_path)
    given = inputs(policy, 50)
    wanted, _ = Exact(policy.contract, (tmp_path / "policy.onnx").read_bytes()).act(*given)
    np.testing.assert_allclose(both(made, *given)[0], np.clip(wanted, -1, 1), rtol=0, atol=1e-6)


def test_past_actions_and_commands_are_those_of_the_runtime(tmp_path: Path) -> None:
    made = compiled(policy_file("hover"), tmp_path)
    c = made.contract
    policy = load_policy(policy_file("hover"))
    past = c.slices["past_actions"]
    rng = np.random.default_rng(0)
    actions = np.tile(np.asarray(c.hover_action, np.float32), ((past.stop - past.start) // 4, 1))
    memory = np.zeros(c.memory_size, np.float32)
    made.begin()
    for observation in random_observations(rng, c.observation, 12):
        observation[past] = actions.ravel()
        wanted, memory = policy.act(observation, memory=memory)
        status, action = made.act(without_past(c, observation))
        assert status == 0
        np.testing.assert_allclose(action, wanted, rtol=0, atol=1e-5)
        np.testing.assert_allclose(made.command(action), policy.command(action), rtol=1e-6, atol=1e-6)
        actions = np.concatenate([action[None], actions[:-1]])
    np.testing.assert_allclose(made.command(np.full(4, 7.0)), c.action.high, rtol=1e-6)  # clipped


def test_it_begins_anew_and_is_then_bit_for_bit_the_same(tmp_path: Path) -> None:
    made = compiled(policy_file("hover"), tmp_path)
    seen = without_past(made.contract, random_observations(np.random.default_rng(0), made.contract.observation, 5))
    flights = []
    for _ in range(2):
        made.begin()
        flights.append([made.act(row)[1].tobytes() for row in seen])
    assert flights[0] == flights[1]
    assert len(set(flights[0])) == len(seen)


def test_what_a_network_must_not_see_changes_nothing(tmp_path: Path) -> None:
    made = compiled(policy_file("avoid"), tmp_path)
    c = made.contract
    observation = random_observations(np.random.default_rng(0), c.observation, 1)[0]
    image = np.full(c.images[0].shape, 3.0)
    made.begin()
    assert made.network(observation, [image])[0] == 0
    before = made.memory.copy()
    turned = observation.copy()
    turned[c.slices["attitude"]] *= 1.02
    far = observation.copy()
    far[c.slices["velocity"]] = 3e38
    for wrong, shown, status in (
        (np.where(np.arange(len(observation)) == 3, np.nan, observation), image, 1),
        (np.where(np.arange(len(observation)) == 3, np.inf, observation), image, 1),
        (turned, image, 2),
        (observation, np.where(image == 3, 10.1, 0), 3),
        (observation, np.where(np.arange(image.size).reshape(image.shape) == 5, np.nan, image), 3),
    ):
        found, action = made.network(wrong, [shown])
        assert found == status
        assert action.tolist() == [9.0] * 4
        np.testing.assert_array_equal(made.memory, before)


@pytest.mark.whole(but=1)
@pytest.mark.parametrize("name", [f"{v}/{t}" for v, tasks in contents().items() for t in tasks if v == "vis_r"])
def test_every_policy_of_a_vehicle_checks_itself(name: str, tmp_path: Path) -> None:
    """By the program that comes with it; it sees a wrong weight."""
    assert run(["export", name, "--c", str(tmp_path), "--name", "flown"]) == 0
    files = [tmp_path / "flown.c", tmp_path / "flown_check.c"]
    check = build(tmp_path / "check", "-O1", *STRICT, *files, "-lm")
    done = subprocess.run([check], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout
    assert "us a step" in done.stdout


def test_the_check_sees_a_wrong_weight(tmp_path: Path) -> None:
    write_c(tmp_path, policy_file("race_any"), "policy", "double")
    source = tmp_path / "policy.c"
    text = source.read_text()
    begin = text.rindex("static const float bias_")
    at = text.index("{", begin) + 1
    source.write_text(f"{text[:at]} 1e-4f + {text[at:]}")
    check = build(tmp_path / "check", "-O1", *STRICT, source, tmp_path / "policy_check.c", "-lm")
    assert subprocess.run([check], stdout=subprocess.DEVNULL).returncode == 1


def test_it_allocates_nothing_and_keeps_nothing_to_itself(tmp_path: Path) -> None:
    write_c(tmp_path, policy_file("race_clutter"), "policy", "float")
    built = build(tmp_path / "policy.o", "-O2", "-std=c99", "-c", tmp_path / "policy.c")
    symbols = [line.split()[-2:] for line in subprocess.check_output(["nm", built], text=True).splitlines()]
    needs, gives = ({name for kind, name in symbols if kind == which} for which in "UT")
    assert needs <= {"expf", "tanhf", "logf", "sqrtf", "memcpy", "memmove", "memset"}
    assert gives == {f"policy_{x}" for x in ("begin", "act", "network", "command")}
    assert not [name for kind, name in symbols if kind in "bBdDC"]  # no variables, constants alone


def test_two_policies_live_in_one_program_of_c_plus_plus(tmp_path: Path) -> None:
    """Sizes of the header are those of the compiler."""
    for name, policy in (("first", "hover"), ("second", "race_clutter")):
        write_c(tmp_path, policy_file(policy), name, "double")
    (tmp_path / "main.cpp").write_text("""
#include "first.h"
#include "second.h"
static_assert(sizeof(first_state) == FIRST_STATE_BYTES, "");
static_assert(sizeof(second_state) == SECOND_STATE_BYTES, "");
static_assert(sizeof(first_seen) / sizeof(float) + 4 * FIRST_PAST_ACTIONS == FIRST_OBSERVATION_SIZE, "");
static first_state one;
static second_state two;
int main() { first_begin(&one); second_begin(&two); return one.memory[0] != 0.0f || two.memory[0] != 0.0f; }
""")
    objects = [build(tmp_path / f"{n}.o", "-O1", *STRICT, "-c", tmp_path / f"{n}.c") for n in ("first", "second")]
    strict = ("-Wall", "-Wextra", "-Werror", "-pedantic")
    program = build(tmp_path / "main", *strict, tmp_path / "main.cpp", *objects, "-lm", name="c++")
    assert subprocess.run([program]).returncode == 0


def test_the_words_of_a_contract_cannot_become_code(tmp_path: Path) -> None:
    """A task of one's own is named by its path, and a field as one likes."""
    content, contract = policy_file("race_any").read_bytes(), load_policy("race_any").contract
    evil = 'a"; */ int evil; /* \\\n#define Y ü??/.py:Name'
    field = dataclasses.replace(contract.observation[0], description=evil, name=evil)
    contract = dataclasses.replace(contract, task=evil, observation=(field, *contract.observation[1:]))
    made = sources(contract, content, "policy", "double")
    (tmp_path / "policy.h").write_text(made.header)
    (tmp_path / "policy.c").write_text(made.source)
    built = build(tmp_path / "policy.o", *STRICT, "-Wtrigraphs", "-c", tmp_path / "policy.c")
    assert "evil" not in subprocess.check_output(["nm", built], text=True)


WORDS = (
    "asm", "typeof", "typeof_unqual", "constexpr", "nullptr", "static_assert", "thread_local", "alignas",
    "and_eq", "char8_t", "co_await", "requires", "int", "inline", "register", "linux", "unix", "i386", "near",
    "far", "min", "NULL", "NAN", "INFINITY", "M_PI", "isfinite", "errno", "stdin", "EOF", "i", "s", "q", "a",
    "low", "span", "real", "state", "seen", "action", "observation", "memory", "scratch", "at", "image_0",
    "height", "memory_size", "_", "2d", "Größe", "__func__", "field_x",
)  # fmt: skip
"""Names of fields and images that mean something to a compiler, a library or the exported code."""


LIBRARY = "#include <math.h>\n#include <stdio.h>\n#include <time.h>\n#include <errno.h>\n"
STANDARDS = ("c c99", "c gnu17", "c gnu2x", "c++ c++98", "c++ gnu++2b")


@pytest.mark.parametrize("standard", STANDARDS)
def test_no_name_is_a_word_of_a_compiler_or_a_macro(standard: str, tmp_path: Path) -> None:
    """A field and an image for each word, and for each macro that there is after the library's headers."""
    language = ("-x", standard.split()[0], f"-std={standard.split()[1]}")
    command = [compiler(), *language, "-dM", "-E", "-"]
    told = subprocess.run(command, input=LIBRARY, capture_output=True, text=True, check=True).stdout
    words = [*WORDS, *(line.split()[1].partition("(")[0] for line in told.splitlines())]
    c = load_policy("avoid").contract
    seen = {field_name(word).upper(): dataclasses.replace(c.observation[0], name=word) for word in words}
    images = {image_name(word).upper(): dataclasses.replace(c.images[0], name=word) for word in words}
    attitude = next(field for field in c.observation if field.frame == "world_body")
    odd = dataclasses.replace(c, observation=(*seen.values(), attitude), images=tuple(images.values()))
    assert len(odd.images) > 300
    (tmp_path / "policy.h").write_text(header(odd, "policy", "", Sizes(1, 8, 8, 8), "double"))
    (tmp_path / "main").write_text(f'{LIBRARY}#include "policy.h"\nint main(void) {{ return 0; }}\n')
    build(tmp_path / "out", "-Wall", "-Wextra", "-Werror", "-pedantic", "-I", tmp_path, *language, tmp_path / "main")


def test_the_code_uses_no_name_of_a_contract(tmp_path: Path) -> None:
    model, c = onnx.load(policy_file("avoid")), load_policy("avoid").contract
    for name in ("state", "asm"):
        for value in model.graph.input:
            value.name = name if value.name == c.images[0].name else value.name
        for node in model.graph.node:
            node.input[:] = [name if value == c.images[0].name else value for value in node.input]
        fields = tuple(dataclasses.replace(f, name=w) for f, w in zip(c.observation[:-1], WORDS, strict=False))
        image = dataclasses.replace(c.images[0], name=name)
        c = dataclasses.replace(c, observation=(*fields, c.observation[-1]), images=(image,))
        made = sources(c, model.SerializeToString(), "int", "double")
        (tmp_path / "int.h").write_text(made.header)
        (tmp_path / "int.c").write_text(made.source)
        build(tmp_path / "int.o", *STRICT, "-c", tmp_path / "int.c")


@pytest.mark.parametrize("names", [("a-b", "a_b"), ("Wheel", "wheel"), ("x__y", "x y")])
def test_names_that_would_be_one_in_c_are_refused(names: tuple[str, str]) -> None:
    c = load_policy("race_any").contract
    first, second = (dataclasses.replace(f, name=n) for f, n in zip(c.observation, names, strict=False))
    odd = dataclasses.replace(c, observation=(first, second, *c.observation[2:]))
    with pytest.raises(ValueError, match=f"the fields '{names[0]}' and '{names[1]}' are both field_"):
        sources(odd, policy_file("race_any").read_bytes(), "policy", "double")


def test_fast_math_is_refused_by_the_compiler(tmp_path: Path) -> None:
    write_c(tmp_path, policy_file("race_any"), "policy", "double")
    with pytest.raises(AssertionError, match="without -ffast-math"):
        build(tmp_path / "policy.o", "-O2", "-ffast-math", "-c", tmp_path / "policy.c")
