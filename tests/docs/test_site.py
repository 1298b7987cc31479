"""The site builds without a warning, its links lead somewhere, and it loads nothing from other hosts."""

import re
import runpy
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass, field
from html.parser import HTMLParser
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlsplit

import pytest
import setuptools

from tests.docs.pages import DOCS, ROOT


@dataclass
class Page(HTMLParser):
    """Of one built page: the anchors, where links lead, what the browser loads, and its paragraphs."""

    ids: set[str] = field(default_factory=set)
    links: list[str] = field(default_factory=list)
    loads: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        super().__init__()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        found = {name: value for name, value in attrs if value is not None}
        self.ids |= {found[name] for name in ("id", "name") if name in found}
        if tag == "a" and "href" in found:
            self.links.append(found["href"])
        elif tag == "link" and found.get("rel") not in ("canonical", "next", "prev"):
            self.loads.append(found["href"])
        elif "src" in found:
            self.loads.append(found["src"])


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(folder)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-4000:]
    return folder


@pytest.fixture(scope="module")
def pages(site: Path) -> dict[Path, Page]:
    found = {}
    for path in sorted(site.rglob("*.html")):
        found[path] = Page()
        found[path].feed(path.read_text(encoding="utf-8"))
    return found


def within(pages: dict[Path, Page]) -> Iterator[tuple[Path, str, Path, str]]:
    """Page, link, the file and the anchor where it leads, for each link that stays in the site."""
    for path, page in pages.items():
        for link in page.links + page.loads:
            parts = urlsplit(link)
            if parts.scheme or parts.netloc or path.name == "404.html":
                continue
            target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            yield path, link, target / "index.html" if target.is_dir() else target, unquote(parts.fragment)


@pytest.mark.whole
def test_every_link_within_the_site_leads_to_a_file_and_an_anchor(pages: dict[Path, Page]) -> None:
    everywhere, broken = list(within(pages)), []
    for path, link, target, anchor in everywhere:
        there = pages[target].ids if target in pages else set()
        if not target.is_file() or (anchor and anchor not in there and not anchor.startswith("__")):
            broken.append(f"{path.name}: {link}")
    assert len(everywhere) > 1000
    assert not broken


def test_links_to_other_hosts_are_whole(pages: dict[Path, Page]) -> None:
    for path, page in pages.items():
        for link in page.links:
            parts = urlsplit(link)
            if parts.scheme or parts.netloc:
                assert parts.scheme == "https", (path, link)
                assert re.fullmatch(r"[a-z0-9-]+(\.[a-z0-9-]+)+", parts.netloc), (path, link)


def test_pages_load_nothing_from_other_hosts(pages: dict[Path, Page]) -> None:
    assert not [(path.name, link) for path, page in pages.items() for link in page.loads if urlsplit(link).netloc]


def test_no_list_or_table_is_shown_as_text(site: Path) -> None:
    """Python-Markdown wants an empty line before them, which GitHub does not."""
    for path in site.rglob("*.html"):
        for paragraph in re.findall(r"<p>(.*?)</p>", path.read_text(encoding="utf-8"), re.DOTALL):
            assert not re.search(r"^(- |\d+\. |\||    \S)", paragraph, re.MULTILINE), (path.name, paragraph[:200])


def test_the_reference_has_what_import_e2efly_offers(pages: dict[Path, Page]) -> None:
    ids = {anchor for path, page in pages.items() if path.parent.name == "reference" for anchor in page.ids}
    wanted = {
        "e2efly.api.train", "e2efly.validation.evaluation.evaluate",
        "e2efly.validation.plant_validation.validate", "e2efly.policy.goal.Goal",
        "e2efly.policy.loader.load_policy", "e2efly.validation.plant.Plant", "train", "eval",
        "e2efly.config.run.TrainConfig", "e2efly.simulation.physics.step.step",
    }  # fmt: skip
    assert wanted <= ids


def test_links_of_the_readme_lead_to_files() -> None:
    links = re.findall(r"\]\(([^)#]+)(?:#[^)]*)?\)", (ROOT / "README.md").read_text(encoding="utf-8"))
    assert links
    assert not [link for link in links if not link.startswith("https://") and not (ROOT / link).exists()]


def test_what_a_package_index_shows_links_to_the_repository_whose_address_stands_in_one_place(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    given = dict[str, Any]()
    monkeypatch.setattr(setuptools, "setup", lambda **keywords: given.update(keywords))
    address = runpy.run_path(str(ROOT / "setup.py"))["ADDRESS"]
    links = [*re.findall(r"\]\(([^)]+)\)", given["long_description"]), *given["project_urls"].values()]
    assert not [link for link in links if not link.startswith(f"{address}/") and link != address]
    files = [file for link in links for file in re.findall(f"{address}/(?:blob|raw)/main/([^#]+)", link)]
    assert len(files) > 40
    assert not [file for file in files if not (ROOT / file).exists()]
    assert not [path for path in (ROOT / "README.md", ROOT / "pyproject.toml") if address in path.read_text("utf-8")]


def test_the_installation_names_every_extra() -> None:
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["optional-dependencies"]
    page = (DOCS / "tutorials" / "install.md").read_text(encoding="utf-8")
    assert not [extra for extra in extras if f"`{extra}`" not in page]
