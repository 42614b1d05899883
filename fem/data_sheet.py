"""Quantities with symbol, unit and meaning: a table to read, a mapping to compute with."""

from collections.abc import Iterable, Iterator, Mapping
from html import escape
from typing import NamedTuple

from fem.representation import quantity

#: Units of the table in place of SI.
DRAWN = {"m": "mm", "rad": "deg", "1": ""}


class Quantity(NamedTuple):
    """A value in SI units ("1": none) and what it is."""

    value: float
    unit: str
    meaning: str

    def __str__(self) -> str:
        return quantity(self.value, DRAWN.get(self.unit, self.unit))


class DataSheet(Mapping[str, Quantity]):
    """Quantities by symbol; print it, or show it in a notebook, as a table.

    title       of the table
    rows        (symbol, value in SI units, unit, meaning) of each
    """

    def __init__(self, title: str, rows: Iterable[tuple[str, float, str, str]]):
        self.title = title
        self._quantities = {symbol: Quantity(value, unit, meaning) for symbol, value, unit, meaning in rows}

    def __getitem__(self, symbol: str) -> Quantity:
        return self._quantities[symbol]

    def __iter__(self) -> Iterator[str]:
        return iter(self._quantities)

    def __len__(self) -> int:
        return len(self._quantities)

    @property
    def _cells(self) -> list[tuple[str, str, str]]:
        return [(symbol, str(row), row.meaning) for symbol, row in self.items()]

    def __str__(self) -> str:
        wide, wider = (max(len(row[i]) for row in self._cells) for i in (0, 1))
        return "\n".join([self.title, *(f"{a:{wide}}  {b:{wider}}  {c}" for a, b, c in self._cells)])

    __repr__ = __str__

    def _repr_html_(self) -> str:
        rows = ("".join(f"<td>{escape(cell)}</td>" for cell in cells) for cells in self._cells)
        body = "".join(f"<tr>{row}</tr>" for row in rows)
        return f"<table><caption>{escape(self.title)}</caption>{body}</table>"
