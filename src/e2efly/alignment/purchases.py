"""What a list of parts says about buying a part: its price, and where its mass and its price come from."""

import re
from collections.abc import Collection
from dataclasses import dataclass
from typing import Any

from e2efly.config.names import unknown
from e2efly.config.tables import number, shown, text

KEYS = {"name", "count", "price_usd", "date", "source", "estimate"}
"""Keys of an entry `[[ground]]`: what a flight needs that stays on the ground."""
_DATE = r"\d{4}(-\d\d(-\d\d)?)?"
TOLD = ("mass", "price_usd")
"""The numbers that `source` and `estimate` speak of."""


@dataclass(frozen=True)
class Purchase:
    """One kind of thing to buy."""

    name: str
    count: int
    """How many of it."""
    price: float | None
    """Price of one, USD. None: the list does not say."""
    date: str | None
    """The day, the month or the year of the price. None: the list does not say."""
    source: dict[str, str]
    """For a number of `TOLD`, the address of the public page that says it."""
    estimate: dict[str, str]
    """For a number of `TOLD` that no public page says as it stands here, how it was estimated."""


def read_purchase(where: str, entry: dict[str, Any], count: int) -> Purchase:
    """The keys of an entry that are about buying it.

    Args:
        where: file and entry, for the error text.
        entry: the entry as read.
        count: how many of it the list has.

    Raises:
        ValueError: naming the key, the value and what is accepted.
    """
    price, date = entry.get("price_usd"), entry.get("date")
    if price is not None and number(f"{where}: price_usd", price) < 0:
        raise ValueError(f"{where}: price_usd is {price}; accepted: 0 or more, the price of one in USD")
    if date is not None and not re.fullmatch(_DATE, str(date)):
        raise ValueError(f'{where}: date is {shown(date)}; accepted: a day, a month or a year, such as "2026-09-11"')
    source = _words(f"{where}: source", entry.get("source", {}))
    for key, page in source.items():
        if not page.startswith(("https://", "http://")):
            raise ValueError(f"{where}: source.{key} is {shown(page)}; accepted: the address of a page, https://...")
    estimate = _words(f"{where}: estimate", entry.get("estimate", {}))
    return Purchase(text(f"{where}: name", entry.get("name")), count, price, date and str(date), source, estimate)


def read_ground(where: str, entry: Any) -> Purchase:
    """An entry `[[ground]]`. Arguments and errors are as for `read_purchase`."""
    check_keys(where, entry, "ground", KEYS)
    count = entry.get("count", 1)
    if type(count) is not int or count < 1:
        raise ValueError(f"{where}: count is {shown(count)}; accepted: a whole number, 1 or more")
    return read_purchase(where, entry, count)


def check_keys(where: str, entry: Any, name: str, keys: Collection[str]) -> None:
    """Refuse an entry that is no table [[name]], or has other keys.

    Raises:
        ValueError: naming it, and what is accepted.
    """
    if not isinstance(entry, dict):
        raise ValueError(f"{where} is {shown(entry)}; accepted: a table [[{name}]]")
    for key in entry:
        if key not in keys:
            raise ValueError(f"{where}: {unknown('key', key, sorted(keys))}")


def _words(where: str, given: Any) -> dict[str, str]:
    if not isinstance(given, dict):
        raise ValueError(f"{where} is {shown(given)}; accepted: a table of texts with the keys {' and '.join(TOLD)}")
    for key, said in given.items():
        if key not in TOLD:
            raise ValueError(f"{where}: {unknown('key', key, list(TOLD))}")
        if not text(f"{where}.{key}", said).strip():
            raise ValueError(f"{where}.{key} is empty; accepted: a text")
    return dict(given)
