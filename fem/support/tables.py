"""Tables of numbers in text files: the header names each column with its unit, the values become SI.

    # any remarks
    torque [N m], phase [1], te [um]
    0,            0.00,      0.12

Columns stand in any order, separated by commas, semicolons, tabs or blanks; quotation marks are dropped. Numbers have a
decimal point. A unit that is missing, unknown or of another quantity, a missing or a further column, a second header,
text, NaN, decimal commas, and points that are given twice are refused with the line.
"""

import re
from collections.abc import Iterable, Mapping
from errno import ENOENT
from math import inf, isfinite, pi
from pathlib import Path
from unicodedata import normalize

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
FACTORS = {unit: factor for units in UNITS.values() for unit, factor in units.items()}
#: A column of a header: its name, and its unit in brackets.
COLUMN = re.compile(r"([^\[\],;]+?)\s*\[([^\[\]]*)\]")
#: What separates the numbers of a line, by what separates the columns of its header, the first that there is; beside
#: semicolons a comma before a digit may be a decimal one.
SEPARATORS = {";": re.compile(r"\s*;\s*|\s*,\s+|\s+"), ",": re.compile(r"\s*,\s*|\s+"), "": re.compile(r"\s+")}
Columns = dict[str, np.ndarray]


def read_table(
    path,
    units: Mapping[str, str],
    *,
    optional: Iterable[str] = (),
    key: Iterable[str] = (),
    largest: Mapping[str, float] | None = None,
) -> Columns:
    """Columns (n,) of a text file in SI units, by name, in the order of `units`.

    units      SI unit of each column, by name
    optional   columns that may be missing
    key        columns, of those that are there, that together tell a row from all others
    largest    largest magnitude of the values of a column [SI], by name

    Raises FileNotFoundError, and ValueError with the number of the line for all that the module refuses.
    """
    header = _header(units, optional)
    columns: dict[str, str] = {}
    separator = SEPARATORS[""]
    rows: dict[int, list[float]] = {}
    for number, line in enumerate(_text(path).replace('"', "").splitlines(), start=1):
        where, is_remark = f"line {number} of {path}", line.lstrip().startswith("#")
        if not columns and "[" in line and not (is_remark and _names_no_column(line, units)):
            columns, separator = _columns(line.strip("# \t"), where, units)
            missing = [name for name in units if name not in columns and name not in optional]
            require(not missing, f"{where} lacks the columns {missing}; the header must hold: {header}")
        elif line.strip() and not is_remark:
            second = f"{where} is a second header; write each table into a separate file, begin remarks with #"
            require("[" not in line, second)
            early = f"{where} comes before a header with units; begin with: {header}; remarks begin with #"
            require(bool(columns), early)
            rows[number] = _values(line.strip(), columns, separator, where, largest or {})
    factors = {name: UNITS[units[name]][unit] for name, unit in columns.items()}
    require(bool(factors), f"{path} has no header with units; begin with: {header}")
    require(bool(rows), f"{path} holds no values below its header; add a line for each point")
    table = dict(zip(factors, (np.array(list(rows.values())) * list(factors.values())).T, strict=True))
    _check_distinct(rows, [list(factors).index(name) for name in key if name in factors], path)
    return {name: table[name] for name in units if name in table}


def read_grid(
    path,
    axes: Mapping[str, str],
    values: Mapping[str, str],
    *,
    optional: Iterable[str] = (),
    largest: Mapping[str, float] | None = None,
) -> tuple[Columns, Columns]:
    """Axes, increasing, and values over them, of a table with a line for each point of a grid, in SI units.

    axes       SI unit of each axis, by name, in the order of the values' dimensions
    values     SI unit of each quantity over the axes
    optional   axes that may be missing
    largest    as for `read_table`

    Raises as `read_table`, and ValueError where a point of the grid is missing.
    """
    table = read_table(path, {**axes, **values}, optional=optional, key=axes, largest=largest)
    names = [name for name in axes if name in table]
    lines, index = zip(*(np.unique(table[name], return_inverse=True) for name in names), strict=True)
    given = np.zeros([line.size for line in lines], bool)
    given[index] = True
    if not given.all():
        first = np.argwhere(~given)[0]
        at = [f"{name} {line[i]:g} {axes[name]}" for name, line, i in zip(names, lines, first, strict=True)]
        point = ", ".join(words.removesuffix(" 1") for words in at)
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
        raise ValueError(f"{path} is no text in UTF-8 ({error.reason}); save it as CSV in UTF-8") from None


def _header(units: Mapping[str, str], optional: Iterable[str]) -> str:
    """The header that a table must have, in words."""
    needed: list[str] = []
    further: list[str] = []
    for name, unit in units.items():
        (further if name in optional else needed).append(f"{name} [{unit}]")
    return ", ".join(needed) + (f"; columns that may follow: {', '.join(further)}" if further else "")


def _names_no_column(remark: str, units: Mapping[str, str]) -> bool:
    """Whether a remark with brackets is no header, as none of its names is that of a column."""
    return not any(name.strip("# \t") in units for name, _ in COLUMN.findall(remark))


def _columns(header: str, where: str, units: Mapping[str, str]) -> tuple[dict[str, str], re.Pattern]:
    """Unit of each column of a header, by name, in its order; what separates the numbers below it."""
    columns = [(name.strip(), unit.strip()) for name, unit in COLUMN.findall(header)]
    rest = COLUMN.sub("", header)
    bare = rest.strip(" \t,;")
    require(not bare, f"{where} gives {bare!r} no unit; write it in brackets: torque [N m], phase [1], te [um]")
    names = [name for name, _ in columns]
    require(len(set(names)) == len(names), f"{where} names a column twice, got {names}; rename or remove one")
    unknown = [name for name in names if name not in units]
    require(not unknown, f"{where} has the columns {unknown}, but may have {list(units)}; rename or remove them")
    for name, unit in columns:
        known = UNITS[units[name]]
        listed = [x for x in known if normalize("NFKC", x) == x]  # both signs of a micrometre look alike
        require(unit in known, f"{where} gives {name} in [{unit}], which must be one of {listed}; convert it")
    return dict(columns), next(pattern for mark, pattern in SEPARATORS.items() if mark in rest)


def _values(
    line: str, columns: Mapping[str, str], separator: re.Pattern, where: str, largest: Mapping[str, float]
) -> list[float]:
    """The numbers of a line, in the units of its columns."""
    cells = (SEPARATORS[";"] if ";" in line else separator).split(line.rstrip(",; \t"))
    names = list(columns)
    point = "; write numbers with a decimal point" if "," in line and len(cells) > len(names) else ""
    require(
        len(cells) == len(names),
        f"{where} holds {len(cells)} values for {len(names)} columns {names}, got {line!r}{point}",
    )
    for (name, unit), cell in zip(columns.items(), cells, strict=True):
        try:
            value = float(cell)
        except ValueError:
            raise ValueError(f"{where} holds {cell!r} for {name}; write numbers with a decimal point") from None
        require(isfinite(value), f"{where} holds {cell} for {name}, which must be finite; complete or remove the line")
        most = largest.get(name, inf) / FACTORS[unit]
        beyond = f"{where} holds {cell} {unit} for {name}, which must lie within {most:g} {unit}"
        require(abs(value) <= most, f"{beyond}; correct the value, or the unit in the header")
    return list(map(float, cells))


def _check_distinct(rows: Mapping[int, list[float]], key: list[int], path) -> None:
    """ValueError where two lines have the same values in the columns of a key."""
    first: dict[tuple[float, ...], int] = {}
    for number, row in rows.items() if key else ():
        before = first.setdefault(tuple(row[i] for i in key), number)
        require(before == number, f"lines {before} and {number} of {path} give the same point; remove one of them")
