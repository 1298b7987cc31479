"""Write the pages of the notebooks in docs/notebooks, with the outputs that are stored in them: `make docs`.

`make notebooks` runs them anew. A page has the notebook's name; its pictures lie beside it.
"""

import base64
import json
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).parent / "notebooks"


def shown(output: dict[str, Any], picture: Path) -> list[str]:
    """The lines of an output; a picture is written to its file."""
    data = output.get("data", {})
    if "image/png" in data:
        picture.write_bytes(base64.b64decode(data["image/png"]))
        return [f"![What the cell draws]({picture.name})", ""]
    text = "".join(output.get("text", data.get("text/plain", ""))).rstrip()
    return ["```text", *text.splitlines(), "```", ""] if text else []


def page(notebook: Path) -> str:
    """The page of a notebook."""
    cells, lines, pictures = json.loads(notebook.read_text(encoding="utf-8"))["cells"], [], 0
    for number, cell in enumerate(cells):
        source = "".join(cell["source"])
        if cell["cell_type"] == "markdown":
            lines += [*source.splitlines(), ""]
        else:
            lines += ["```python", *source.splitlines(), "```", ""]
            for output in cell["outputs"]:
                lines += shown(output, notebook.with_name(f"{notebook.stem}-{pictures + 1}.png"))
                pictures += "image/png" in output.get("data", {})
        if number == 0:
            lines += [f"This page is a notebook: [{notebook.name}]({notebook.name}).", ""]
    return "\n".join(lines)


if __name__ == "__main__":
    for notebook in sorted(FOLDER.glob("*.ipynb")):
        notebook.with_suffix(".md").write_text(page(notebook), encoding="utf-8")
