"""Data sheet of a gear or a pair: quantities by symbol with unit and meaning, a table that is also a mapping."""

from collections.abc import Iterable, Iterator, Mapping
from html import escape
from typing import NamedTuple

from fem.support.arguments import checked
from fem.support.representation import quantity

#: Units that the printed table uses instead of SI units.
PRINTED = {"m": "mm", "rad": "deg", "1": ""}
#: Unit and meaning of the quantities of a gear, and of a pair (index 1: pinion, 2: wheel).
GEAR = {
    "z": ("1", "number of teeth"),
    "m_n": ("m", "normal module"),
    "m_t": ("m", "transverse module"),
    "alpha_n": ("rad", "normal pressure angle"),
    "alpha_t": ("rad", "transverse pressure angle"),
    "beta": ("rad", "helix angle, > 0 right-hand"),
    "beta_b": ("rad", "base helix angle"),
    "x": ("1", "profile shift coefficient"),
    "b": ("m", "face width"),
    "d": ("m", "reference diameter"),
    "d_b": ("m", "base diameter"),
    "d_a": ("m", "tip diameter"),
    "d_f": ("m", "root diameter"),
    "d_Ff": ("m", "root form diameter"),
    "h": ("m", "tooth depth"),
    "p_bt": ("m", "transverse base pitch"),
    "p_bn": ("m", "normal base pitch"),
    "s_n": ("m", "normal tooth thickness on the reference circle"),
    "s_t": ("m", "transverse tooth thickness on the reference circle"),
    "s_an": ("m", "normal tooth thickness on the tip circle"),
    "s_bn": ("m", "normal tooth thickness on the base circle"),
    "mass": ("kg", "mass, the bore filled"),
    "inertia": ("kg m^2", "inertia about the axis, the bore filled"),
}
#: What differs of an internal gear.
RING = {
    "mass": ("kg", "mass of the ring out to d_rim"),
    "inertia": ("kg m^2", "inertia about the axis of the ring out to d_rim"),
}
PAIR = {
    "u": ("1", "gear ratio"),
    "a": ("m", "working centre distance"),
    "a_0": ("m", "centre distance without backlash"),
    "alpha_wt": ("rad", "working transverse pressure angle"),
    "d_w1": ("m", "working pitch diameter of the pinion"),
    "d_w2": ("m", "working pitch diameter of the wheel"),
    "p_bt": ("m", "transverse base pitch"),
    "g_alpha": ("m", "length of the path of contact"),
    "eps_alpha": ("1", "transverse contact ratio"),
    "eps_beta": ("1", "overlap ratio"),
    "eps_gamma": ("1", "total contact ratio"),
    "j_bt": ("m", "backlash along the line of action"),
    "j_wt": ("m", "circumferential backlash on the working pitch circles"),
    "j_bn": ("m", "normal backlash"),
    "j_r": ("m", "radial backlash, a - a_0"),
    "c_1": ("m", "clearance of the pinion's tip"),
    "c_2": ("m", "clearance of the wheel's tip"),
    "d_Ff1": ("m", "root form diameter of the pinion"),
    "d_Nf1": ("m", "active root diameter of the pinion"),
    "d_Na1": ("m", "active tip diameter of the pinion"),
    "d_Ff2": ("m", "root form diameter of the wheel"),
    "d_Nf2": ("m", "active root diameter of the wheel"),
    "d_Na2": ("m", "active tip diameter of the wheel"),
    "K_gf": ("1", "sliding factor at the pinion's root"),
    "K_ga": ("1", "sliding factor at the pinion's tip"),
    "zeta_f1": ("1", "specific sliding at the pinion's root"),
    "zeta_f2": ("1", "specific sliding at the wheel's root"),
}
#: Further quantities of a pinion in a ring.
RING_PAIR = {
    "radial_clearance": ("m", "clearance as the pinion is pushed in radially; < 0: assemble along the axis"),
}
Row = tuple[str, float, str, str]


@checked
class Quantity(NamedTuple):
    """A value in SI units ("1": dimensionless) with its meaning."""

    value: float
    unit: str
    meaning: str

    def __str__(self) -> str:
        return quantity(self.value, PRINTED.get(self.unit, self.unit))


@checked
class DataSheet(Mapping[str, Quantity]):
    """Quantities by symbol; print it, or show it in a notebook, as a table.

    title       title of the table
    rows        (symbol, value in SI units, unit, meaning) of each quantity
    """

    def __init__(self, title: str, rows: Iterable[Row]):
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
        widths = [max(len(row[i]) for row in self._cells) for i in (0, 1)]
        rows = (f"{symbol:{widths[0]}}  {value:{widths[1]}}  {meaning}" for symbol, value, meaning in self._cells)
        return "\n".join([self.title, *rows])

    __repr__ = __str__

    def _repr_html_(self) -> str:
        rows = ("".join(f"<td>{escape(cell)}</td>" for cell in cells) for cells in self._cells)
        body = "".join(f"<tr>{row}</tr>" for row in rows)
        return f"<table><caption>{escape(self.title)}</caption>{body}</table>"


def listed(meanings: Mapping[str, tuple[str, str]], instance, sizes: Mapping[str, float]) -> list[Row]:
    """Rows of a data sheet; quantities that are not among the sizes are attributes of the instance."""
    values = {symbol: sizes[symbol] if symbol in sizes else getattr(instance, symbol) for symbol in meanings}
    return [(symbol, values[symbol], *meaning) for symbol, meaning in meanings.items()]
