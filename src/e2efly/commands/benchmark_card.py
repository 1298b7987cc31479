"""A card of `e2efly benchmark` for people: the page, and the one line of a policy. Imports no JAX."""

from typing import Any

from e2efly.commands.terminal import markdown

HELD = 0.95
"""Success with which a policy is said to fly with a latency."""
WORDS = {
    "latency": "By latency, from observation to command",
    "trained": "Rows that trainings draw from",
    "untrained": "Rows from laws that no training draws from",
}


def in_short(card: dict[str, Any]) -> dict[str, str]:
    """One line of a table: a policy, and its success in percent with 95 % intervals."""
    from e2efly.validation.scorecard import HOME, LATENCY, NOMINAL, TRAINED, UNTRAINED

    by = {(part["place"], part["kind"]): part for part in card["parts"]}
    row = {
        "policy": card["policy"] if card["baseline"] is None else card["baseline"],
        "task": card["task"],
        "vehicle": card["vehicle"],
        "nominal": _alone(by.get((HOME, TRAINED)), NOMINAL),
        "trained rows": _mean(by.get((HOME, TRAINED))),
        "untrained rows": _mean(by.get((HOME, UNTRAINED))),
        f"{100 * HELD:g} % at": held(by[HOME, LATENCY]["rows"]) if (HOME, LATENCY) in by else "-",
    }
    for place in dict.fromkeys(part["place"] for part in card["parts"] if part["place"] != HOME):
        row[f"{place}: trained"] = _mean(by.get((place, TRAINED)))
        row[f"{place}: untrained"] = _mean(by.get((place, UNTRAINED)))
    return row


def held(rows: dict[str, Any]) -> str:
    """The longest run of latencies with which a policy succeeds in `HELD` of the starts or more."""
    from e2efly.validation.scorecard import worst_criterion

    best: list[str] = []
    run: list[str] = []
    for name, criteria in rows.items():
        run = [*run, name] if worst_criterion(criteria)["success"] >= HELD else []
        best = max(best, run, key=len)
    return "none" if not best else best[0] if len(best) == 1 else f"{best[0].split()[0]} to {best[-1]}"


def page(content: dict[str, Any]) -> str:
    """The card as Markdown."""
    lines = [
        "# Benchmark of `e2efly benchmark`",
        "",
        f"Version {content['benchmark']}, seed {content['seed']}. Percent of the starts that succeed, of the worst "
        "criterion, with 95 % intervals by Wilson. The interval of a mean is that of as many starts as one row has.",
        "",
    ]
    for row in map(in_short, content["cards"]):
        lines += [*markdown([row]), ""]  # cards may have other plants
    for card in content["cards"]:
        lines += _card(card)
    return "\n".join(lines)


def _card(card: dict[str, Any]) -> list[str]:
    flies = card["policy"] if card["baseline"] is None else f"{card['baseline']} under the contract of {card['policy']}"
    low, high = (f"{1e3 * late:g}" for late in card["trained_latency_s"])
    about = {
        "flies": flies,
        "task": card["task"],
        "vehicle": f"{card['vehicle']}, {card['vehicle_hash']}; flight controller tuned for: {card['controller']}",
        "commands": f"{card['command_mode']} at {card['control_rate_hz']:g} Hz",
        "latency": f"{1e3 * card['latency_s']:g} ms; of the contract: {low} to {high} ms",
        "file": f"SHA-256 {card['sha256']}",
    }
    lines = [f"## {card['policy']}", "", *markdown([{"": name, " ": text} for name, text in about.items()]), ""]
    lines += [line for note in card["notes"] for line in (note, "")]
    for part in card["parts"]:
        lines += [f"### {WORDS[part['kind']]}: {part['place']}", ""]
        flown = f"{part['episodes']} starts a row, in {part['seconds']:.0f} s on {part['cpu']}"
        lines += [f"{flown}, {part['date']}, e2efly {part['e2efly']}.", ""]
        if "refused" in part:
            lines += [f"Not flown: {part['refused']}", ""]
            continue
        lines += [*markdown([row for name, criteria in part["rows"].items() for row in _rows(name, criteria)]), ""]
        for row, lack in part.get("left_out", {}).items():
            lines += [f"Left out: {row}; {part['place']} cannot change {lack}.", ""]
    return lines


def _rows(name: str, criteria: dict[str, Any]) -> list[dict[str, str]]:
    return [
        {
            "row": name if len(criteria) == 1 else f"{name}: {criterion}",
            "success, %": percent(figures["success"]),
            "95 %": between(figures["success_interval_95"]),
            "crashed": str(figures["crashed"]),
            "final error, cm": f"{100 * figures['final_error_m']:.1f}",
        }
        for criterion, figures in criteria.items()
    ]


def _alone(part: dict[str, Any] | None, row: str) -> str:
    from e2efly.validation.scorecard import worst_criterion

    if part is None or row not in part.get("rows", {}):
        return "-"
    figures = worst_criterion(part["rows"][row])
    return f"{percent(figures['success'])} ({between(figures['success_interval_95'])})"


def _mean(part: dict[str, Any] | None) -> str:
    from e2efly.validation.scorecard import Mean

    if part is None or not part.get("rows"):
        return "-"
    mean = Mean.of(part["rows"])
    lowest = "" if mean.lowest == 1 else f"; {mean.worst} {percent(mean.lowest)}"
    return f"{percent(mean.success)} ({between(mean.interval)}){lowest}"


def percent(share: float) -> str:
    """A share in percent."""
    return f"{100 * share:.1f}"


def between(interval: Any) -> str:
    """An interval of a share in percent."""
    low, high = map(percent, interval)
    return f"{low} to {high}"
