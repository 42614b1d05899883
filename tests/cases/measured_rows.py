"""Numbers that tests assert, and the rows of examples/MEASURED.md that state them.

A test states a number by the fixture `measured`. `pytest --write-measured` writes the numbers of all tests that ran
into the rows of the table; rows of other tests stay.
"""

from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pytest

MEASURED = Path(__file__).parents[2] / "examples" / "MEASURED.md"
#: Name of the property of a report in which a test leaves its numbers.
PROPERTY = "measured"


def deviation(actual, expected) -> float:
    """Largest relative deviation of numbers from those expected."""
    return float(np.abs(np.asarray(actual, float) / np.asarray(expected, float) - 1).max())


class Measured:
    """What a test states: each call is a row of the table, named by its first cell."""

    def __init__(self, record_property):
        self._record = record_property

    def __call__(self, row: str, error: float, limit: float) -> None:
        """Assert that an error lies below its limit, and state the largest one of all cases of the test."""
        self._record(PROPERTY, (row, "error", float(error), float(limit)))
        print(f"{row}: {error:.3g}, asserted {limit:.3g}")
        assert error < limit

    def number(self, row: str, value: float, form: str = "{}") -> None:
        """State a number, or the range over all cases of the test."""
        self._record(PROPERTY, (row, "number", float(value), form))
        print(f"{row}: {value:.6g}")

    def cells(self, row: str, *cells: str) -> None:
        """State the cells beside the name of a row."""
        self._record(PROPERTY, (row, "cells", *cells))
        print(f"{row}: {' | '.join(cells)}")


def share_in_words(share: float) -> str:
    """A share as engineers write it: in per cent down to 0.1 %, else by its power of ten."""
    if share == 0:
        return "rounding"
    return f"{100 * share:.2g} %" if share >= 1e-3 else f"{share:.1e}".replace("e-0", "e-").replace(".0e", "e")


def cells_of(stated: list[tuple]) -> list[str]:
    """The cells of a row from all that tests have stated of it."""
    kind, values = stated[0][1], [each[2:] for each in stated]
    if kind == "error":
        error, limit = (share_in_words(max(column)) for column in zip(*values, strict=True))
        return [f"within {error} (asserted {limit})"]
    if kind == "number":
        form, numbers = values[0][1], [number for number, _ in values]
        low, high = f"{min(numbers):.4g}", f"{max(numbers):.4g}"
        return [form.format(low if low == high else f"{low} to {high}")]
    return list(values[0])


def written(document: str, stated: Iterable[tuple]) -> str:
    """The document with the cells of its rows replaced; ValueError for a row that it does not have exactly once."""
    lines, rows = document.splitlines(), {}
    for each in stated:
        rows.setdefault(each[0], []).append(each)
    for row, numbers in rows.items():
        at = [i for i, line in enumerate(lines) if line.startswith(f"| {row} |")]
        if len(at) != 1:
            raise ValueError(f"{MEASURED.name} must have one row {row!r}, it has {len(at)}")
        cells = lines[at[0]].split(" | ")
        new = cells_of(numbers)
        lines[at[0]] = " | ".join([cells[0], *new, *cells[1 + len(new) :]])
    return "\n".join(lines) + "\n"


def pytest_addoption(parser) -> None:
    parser.addoption("--write-measured", action="store_true", help="write what tests measure into examples/MEASURED.md")


def pytest_terminal_summary(terminalreporter, config) -> None:
    if not config.getoption("--write-measured"):
        return
    passed = terminalreporter.stats.get("passed", [])
    stated = [tuple(value) for report in passed for name, value in report.user_properties if name == PROPERTY]
    MEASURED.write_text(written(MEASURED.read_text(encoding="utf-8"), stated), encoding="utf-8")
    terminalreporter.write_line(f"{len({each[0] for each in stated})} rows of {MEASURED.name} written")


@pytest.fixture
def measured(record_property) -> Measured:
    return Measured(record_property)
