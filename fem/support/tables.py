"""Tables of numbers in text files: the header names each column with its unit, the values become SI.

    # any remarks
    torque [N m], phase [1], te [um]
    0,            0.00,      0.12

Columns stand in any order, separated by commas, semicolons, tabs or blanks. A unit that is missing, unknown or of
another quantity, a missing or a further column, a second header, text, NaN, and points that are given twice are refused
with the line.
"""

import re
from collections.abc import Iterable, Mapping
from errno import ENOENT
from math import isfinite, pi
from pathlib import Path

import numpy as np

from fem.support.validation import require

#: SI units with the other units of the same quantity that a header may name, and their factors.
UNITS = {
    "1": {"1": 1.0, "-": 1.0, "%": 1e-2},
    "m": {"m": 1.0, "mm": 1e-3, "um": 1e-6, "µm": 1e-6, "μm": 1e-6},
    "rad": {"rad": 1.0, "mrad": 1e-3, "deg": pi / 180, "°": pi / 180},
    "s": {"s": 1.0, "ms": 1e-3, "h": 3600.0},
    "rad/s": {"rad/s": 1.0, "rpm": pi / 30, "1/min": pi / 30},
    "Hz": {"Hz": 1.0, "kHz": 1e3},
    "N": {"N": 1.0, "kN": 1e3},
    "N m": {"N m": 1.0, "Nm": 1.0, "kN m": 1e3, "kNm": 1e3},
    "N/m": {"N/m": 1.0, "N/mm": 1e3, "N/um": 1e6, "N/µm": 1e6, "N/μm": 1e6},
    "Pa": {"Pa": 1.0, "MPa": 1e6, "N/mm^2": 1e6, "GPa": 1e9},
    "kg": {"kg": 1.0, "g": 1e-3},
}
#: A column of a header: its name, and its unit in brackets.
COLUMN = re.compile(r"([^\[\],;]+?)\s*\[([^\[\]]*)\]")
SEPARATOR = re.compile(r"\s*[,;]\s*|\s+")
Columns = dict[str, np.ndarray]


def read_table(path, units: Mapping[str, str], *, optional: Iterable[str] = (), key: Iterable[str] = ()) -> Columns:
    """Columns (n,) of a text file in SI units, by name, in the order of `units`.

    units      SI unit of each column, by name
    optional   columns that may be missing
    key        columns, of those that are there, that together tell a row from all others

    Raises FileNotFoundError, and ValueError with the number of the line for all that the module refuses.
    """
    header = ", ".join(f"{name} [{unit}]" for name, unit in units.items() if name not in optional)
    factors: dict[str, float] = {}
    rows: dict[int, list[float]] = {}
    for number, line in enumerate(_text(path).splitlines(), start=1):
        where = f"line {number} of {path}"
        if not factors and "[" in line:
            factors = _factors(line.strip("# \t"), where, units)
            missing = [name for name in units if name not in factors and name not in optional]
            require(not missing, f"{where} lacks the columns {missing}; the header must hold: {header}")
        elif COLUMN.search(line) and not line.lstrip().startswith("#"):
            raise ValueError(f"{where} is a second header; give each table a file of its own")
        elif line.strip() and not line.lstrip().startswith("#"):
            second = f"{where} is a second header; keep one table in a file, remarks begin with #"
            require("[" not in line, second)
            require(bool(factors), f"{where} comes before a header with units; begin with: {header}")
            rows[number] = _values(line.strip(), list(factors), where)
    require(bool(factors), f"{path} has no header with units; begin with: {header}")
    require(bool(rows), f"{path} holds no values below its header; add a line for each point")
    table = dict(zip(factors, (np.array(list(rows.values())) * list(factors.values())).T, strict=True))
    _check_distinct(rows, [list(factors).index(name) for name in key if name in factors], path)
    return {name: table[name] for name in units if name in table}


def read_grid(
    path, axes: Mapping[str, str], values: Mapping[str, str], *, optional: Iterable[str] = ()
) -> tuple[Columns, Columns]:
    """Axes, increasing, and values over them, of a table with a line for each point of a grid, in SI units.

    axes       SI unit of each axis, by name, in the order of the values' dimensions
    values     SI unit of each quantity over the axes
    optional   axes that may be missing

    Raises as `read_table`, and ValueError where a point of the grid is missing.
    """
    table = read_table(path, {**axes, **values}, optional=optional, key=axes)
    names = [name for name in axes if name in table]
    lines, index = zip(*(np.unique(table[name], return_inverse=True) for name in names), strict=True)
    given = np.zeros([line.size for line in lines], bool)
    given[index] = True
    if not given.all():
        first = np.argwhere(~given)[0]
        point = ", ".join(f"{name} {line[i]:g} {axes[name]}" for name, line, i in zip(names, lines, first, strict=True))
        size = " x ".join(map(str, given.shape))
        raise ValueError(f"{path} lacks {(~given).sum()} of {size} points of its grid; add a line for {point}")
    grids = {name: np.empty(given.shape) for name in values}
    for name, grid in grids.items():
        grid[index] = table[name]
    return dict(zip(names, lines, strict=True)), grids


def _text(path) -> str:
    require(not Path(path).is_dir(), f"{path} is a folder; give the name of a file in it")
    if not Path(path).exists():
        raise FileNotFoundError(ENOENT, f"{path} does not exist; correct the path")
    try:
        return Path(path).read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise ValueError(f"{path} is no text in UTF-8 ({error.reason}); save it as text, CSV for example") from None


def _factors(header: str, where: str, units: Mapping[str, str]) -> dict[str, float]:
    """Factor to SI units of each column of a header, by name, in its order."""
    columns = [(name.strip(), unit.strip()) for name, unit in COLUMN.findall(header)]
    bare = COLUMN.sub("", header).strip(" \t,;")
    require(not bare, f"{where} gives {bare!r} no unit; write it in brackets: torque [N m], phase [1], te [um]")
    names = [name for name, _ in columns]
    require(len(set(names)) == len(names), f"{where} names a column twice, got {names}; rename or remove one")
    unknown = [name for name in names if name not in units]
    require(not unknown, f"{where} has the columns {unknown}, but may have {list(units)}; rename or remove them")
    for name, unit in columns:
        known = UNITS[units[name]]
        require(unit in known, f"{where} gives {name} in [{unit}], which must be one of {list(known)}; convert it")
    return {name: UNITS[units[name]][unit] for name, unit in columns}


def _values(line: str, names: list[str], where: str) -> list[float]:
    """The numbers of a line."""
    cells = SEPARATOR.split(line.rstrip(",; \t"))
    require(
        len(cells) == len(names), f"{where} holds {len(cells)} values for {len(names)} columns {names}, got {line!r}"
    )
    for name, cell in zip(names, cells, strict=True):
        try:
            is_finite = isfinite(float(cell))
        except ValueError:
            raise ValueError(f"{where} holds {cell!r} for {name}; write numbers with a decimal point") from None
        require(is_finite, f"{where} holds {cell} for {name}, which must be finite; complete or remove the line")
    return list(map(float, cells))


def _check_distinct(rows: Mapping[int, list[float]], key: list[int], path) -> None:
    """ValueError where two lines have the same values in the columns of a key."""
    first: dict[tuple[float, ...], int] = {}
    for number, row in rows.items() if key else ():
        before = first.setdefault(tuple(row[i] for i in key), number)
        require(before == number, f"lines {before} and {number} of {path} give the same point; remove one of them")
