"""The page of an alignment: one HTML file with its pictures inside, which a browser shows offline."""

import base64
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path

_STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; color: #222; max-width: 1000px; margin: 2em auto; padding: 0 1em; }
h1 { font-size: 1.7em; margin-bottom: 0; } h2 { margin-top: 2em; border-bottom: 2px solid #0072B2; }
table { border-collapse: collapse; margin: 1em 0; font-size: .92em; font-variant-numeric: tabular-nums; }
caption { text-align: left; font-weight: 600; padding: .3em 0; }
th, td { text-align: left; padding: .2em .9em .2em 0; border-bottom: 1px solid #ddd; vertical-align: top; }
th { color: #555; font-weight: 600; } .missing { background: #fff4e5; padding: .6em 1em; }
.about, figcaption { color: #555; } figure { margin: 1em 0; } img { max-width: 100%; }
@media print { h2 { break-after: avoid; } figure, table { break-inside: avoid; } }
"""


@dataclass(frozen=True)
class PageTable:
    """A table of a page: plain texts."""

    title: str
    """Above the table."""
    head: tuple[str, ...]
    """The names of the columns."""
    rows: tuple[tuple[str, ...], ...]
    """The rows, as long as the head."""


@dataclass(frozen=True)
class PageSection:
    """A section of the page."""

    title: str
    """Its heading."""
    said: tuple[str, ...] = ()
    """Paragraphs, plain text."""
    tables: tuple[PageTable, ...] = ()
    """Its tables."""
    pictures: tuple[tuple[Path, str], ...] = ()
    """PNG files, each with its caption."""
    missing: str = ""
    """What is not there, and how to get it. Empty: nothing is missing."""


def alignment_page(title: str, about: Sequence[str], stages: Sequence[PageSection]) -> str:
    """The page as HTML. All texts are shown as they are, whatever is in them.

    Raises:
        OSError: when a picture cannot be read.
    """
    sections = "\n".join(f"<h2>{i}. {escape(stage.title)}</h2>\n{_section(stage)}" for i, stage in enumerate(stages, 1))
    head = f'<meta charset="utf-8">\n<title>{escape(title)}</title>\n<style>{_STYLE}</style>'
    told = "\n".join(f'<p class="about">{escape(line)}</p>' for line in about)
    return (
        f'<!DOCTYPE html>\n<html lang="en">\n<head>\n{head}\n</head>\n<body>\n<h1>{escape(title)}</h1>\n{told}\n'
        f"{sections}\n</body>\n</html>\n"
    )


def _section(stage: PageSection) -> str:
    parts = [f"<p>{escape(text)}</p>" for text in stage.said]
    if stage.missing:
        parts.append(f'<p class="missing">{escape(stage.missing)}</p>')
    parts += map(_table, stage.tables)
    parts += [_picture(path, caption) for path, caption in stage.pictures]
    return "\n".join(parts)


def _table(table: PageTable) -> str:
    def row(cells: tuple[str, ...], tag: str) -> str:
        return f"<tr>{''.join(f'<{tag}>{escape(cell)}</{tag}>' for cell in cells)}</tr>"

    rows = "\n".join(row(cells, "td") for cells in table.rows)
    return f"<table>\n<caption>{escape(table.title)}</caption>\n{row(table.head, 'th')}\n{rows}\n</table>"


def _picture(path: Path, caption: str) -> str:
    content = base64.b64encode(path.read_bytes()).decode()
    told = escape(caption)
    return f'<figure><img src="data:image/png;base64,{content}" alt="{told}"><figcaption>{told}</figcaption></figure>'
