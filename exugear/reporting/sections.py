"""What a report consists of: sections with sentences, lists, tables and figures."""

from dataclasses import dataclass
from typing import NamedTuple


class Table(NamedTuple):
    """A table of texts: caption, names of the columns, rows of as many cells."""

    caption: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


class Figure(NamedTuple):
    """A figure: caption, and its SVG as base64 text."""

    caption: str
    svg: str


@dataclass(frozen=True)
class Section:
    """A section of a report.

    title     heading
    items     sentences, shown as a list
    tables    shown below the list
    figures   shown below the tables
    """

    title: str
    items: tuple[str, ...] = ()
    tables: tuple[Table, ...] = ()
    figures: tuple[Figure, ...] = ()

    @property
    def empty(self) -> bool:
        """Whether there is nothing to show."""
        return not (self.items or self.tables or self.figures)
