"""Rows as tables: for people on a console, and as markdown."""

from typing import Any

from rich.table import Table


def console_table(rows: list[dict[str, Any]]) -> Table:
    """For `rich`: the first row's keys are the headings."""
    table = Table(box=None, header_style="bold", pad_edge=False)
    for heading in rows[0]:
        table.add_column(heading, no_wrap=True)
    for row in rows:
        table.add_row(*map(str, row.values()))
    return table


def markdown(rows: list[dict[str, Any]]) -> list[str]:
    """Lines of a markdown table: the first row's keys are the headings."""
    heads = list(rows[0])
    return [
        "| " + " | ".join(heads) + " |",
        "| " + " | ".join("---" for _ in heads) + " |",
        *("| " + " | ".join(str(row[head]) for head in heads) + " |" for row in rows),
    ]
