"""The Dockerfiles copy what is there and run what the documentation says. No image is built."""

import importlib.util
import json
import re
import shlex
import tomllib

import pytest

from tests.docs.pages import DOCS, ROOT

FILES = sorted((ROOT / "docker").glob("*.Dockerfile"))


def instructions(text: str) -> list[tuple[str, str]]:
    """Instruction and arguments of each line that is no comment, continued lines joined."""
    joined = re.sub(r"\\\n", " ", text)
    lines = [line.strip() for line in joined.splitlines() if line.strip() and not line.startswith("#")]
    return [(line.split(maxsplit=1)[0], line.split(maxsplit=1)[1]) for line in lines]


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_dockerfile(path) -> None:  # noqa: ANN001
    found = instructions(path.read_text(encoding="utf-8"))
    assert found[0][0] == "FROM"
    assert {name for name, _ in found} <= {"FROM", "RUN", "COPY", "WORKDIR", "ENV", "USER", "ENTRYPOINT", "CMD"}
    allowed = [
        line[1:] for line in (ROOT / ".dockerignore").read_text(encoding="utf-8").splitlines() if line[:1] == "!"
    ]
    sources = [source for name, text in found if name == "COPY" for source in shlex.split(text)[:-1]]
    assert sources
    for source in sources:
        assert (ROOT / source).exists(), source
        assert source in allowed, f"{source} is left out by .dockerignore"
    part = "onboard" if path.stem.startswith("fly") else "."
    project = tomllib.loads((ROOT / part / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    installed = re.findall(
        r"pip install [^']*?(?:'\.\[([a-z0-9,-]+)\]'|\./onboard)$", "\n".join(t for _, t in found), re.M
    )
    assert len(installed) == 1
    assert set(filter(None, installed[0].split(","))) <= set(project["optional-dependencies"])
    read = {"setup.py", "README.md"} if "dynamic" in project else set()  # which writes the metadata from the README
    assert {*project["license-files"]} | read <= set(sources)
    (entry,) = (json.loads(text) for name, text in found if name == "ENTRYPOINT")
    assert entry[-1] == "e2efly"
    assert "e2efly" in project["scripts"]
    for module in entry[2:-1]:  # python -m MODULE e2efly
        assert importlib.util.find_spec(module)


def test_the_python_of_the_images_is_one_that_the_project_takes() -> None:
    for path in FILES:
        (version,) = re.findall(r"^FROM python:(\d+\.\d+)", path.read_text(encoding="utf-8"), re.MULTILINE)
        assert tuple(map(int, version.split("."))) >= (3, 11)


def test_the_documentation_builds_and_runs_them_as_they_say_themselves() -> None:
    assert [path.stem for path in FILES] == ["cpu", "cuda", "fly"]
    for path in FILES:
        name = "onboard.md" if path.stem == "fly" else "tutorials/install.md"
        page = (DOCS / name).read_text(encoding="utf-8")
        commands = re.findall(r"^#   (docker .*)$", path.read_text(encoding="utf-8"), re.MULTILINE)
        assert len(commands) == 2
        assert not [command for command in commands if f"$ {command}\n" not in page]
