"""What the metadata has beside pyproject.toml: the package's links, and its README with links that hold anywhere.

A release writes the address of the repository here, and nowhere else.
"""

import re
from pathlib import Path

from setuptools import setup

ADDRESS = "https://example.invalid/e2efly"
"""Address of the repository. A package index refuses this placeholder's pages, but not the package."""
FILES, PICTURES = f"{ADDRESS}/blob/main/", f"{ADDRESS}/raw/main/"
"""Where the repository shows its files, and where it gives them as they are."""


def described() -> str:
    """README.md, whose links to files of the repository hold without the repository."""
    text = (Path(__file__).parent / "README.md").read_text(encoding="utf-8")
    text = text.replace("ADDRESS-OF-THIS-REPOSITORY", ADDRESS)
    return re.sub(r"(!?)(\[[^]]*\])\((?!https?:|#)", lambda m: f"{m[1]}{m[2]}({PICTURES if m[1] else FILES}", text)


setup(
    long_description=described(),
    long_description_content_type="text/markdown",
    project_urls={
        "Source": ADDRESS,
        "Documentation": f"{FILES}docs/index.md",
        "Changelog": f"{FILES}CHANGELOG.md",
        "Issues": f"{ADDRESS}/issues",
    },
)
