"""Values of a REXS file in SI units, and the account of all that is read, assumed and left out."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from math import isfinite, pi
from typing import Any, NamedTuple

import numpy as np

from exugear.exchange.rexs_file import Component, RexsFile
from fem.support.validation import require, text_of

#: SI unit of a quantity, and the units of REXS for it with their factors; degrees Celsius count from 0 deg C.
UNITS = {
    "1": {"": 1.0, "none": 1.0, "%": 1e-2},
    "m": {"m": 1.0, "mm": 1e-3, "mum": 1e-6},
    "rad": {"rad": 1.0, "deg": pi / 180, "°": pi / 180},
    "rad/s": {"rad / s": 1.0, "1 / min": pi / 30, "1 / s": 2 * pi},
    "N": {"N": 1.0, "kN": 1e3},
    "N m": {"N m": 1.0, "N mm": 1e-3, "kN m": 1e3},
    "N/m": {"N / m": 1.0, "N / mm": 1e3, "N / mum": 1e6},
    "N m/rad": {"N m / rad": 1.0, "N mm / rad": 1e-3},
    "Pa": {"Pa": 1.0, "MPa": 1e6, "N / mm^2": 1e6},
    "kg": {"kg": 1.0},
    "kg m^2": {"kg m^2": 1.0, "kg mm^2": 1e-6},
    "kg/m^3": {"kg / dm^3": 1e3, "kg / m^3": 1.0},
    "W": {"W": 1.0, "kW": 1e3},
    "deg C": {"C": 1.0},
}
#: Attributes that hold no physics: colours, dates, folders.
SILENT = {"display_color", "folder", "modification_date", "version", "name", "description"}


class Row(NamedTuple):
    """A line of the account: what happened to a part of the file ("read", "assumed", "left out"), which, and how."""

    kind: str
    part: str
    text: str


@dataclass
class Account:
    """What was read of a file, what was assumed, and what was left out: nothing is lost in silence."""

    rows: list[Row] = field(default_factory=list)

    def read(self, part: str, text: str) -> None:
        """Note what a part of the file became."""
        self._note(Row("read", part, text))

    def assumed(self, part: str, text: str) -> None:
        """Note what the file does not say."""
        self._note(Row("assumed", part, text))

    def left_out(self, part: str, text: str) -> None:
        """Note what the gearbox does not hold."""
        self._note(Row("left out", part, text))

    def _note(self, row: Row) -> None:
        if row not in self.rows:
            self.rows.append(row)

    def __str__(self) -> str:
        widths = [max((len(row[i]) for row in self.rows), default=0) for i in (0, 1)]
        return "\n".join(f"{kind:<{widths[0]}}  {part:<{widths[1]}}  {text}" for kind, part, text in self.rows)


@contextmanager
def placing_errors(component: Component, file: RexsFile) -> Iterator[None]:
    """Let a ValueError of gears, bearings and pairs say which component of the file it comes from, with its line."""
    try:
        yield
    except ValueError as error:
        told = component.title in str(error)
        raise error if told else ValueError(f"{component.title} of {file.path}: {error}") from None


class Reading:
    """Access to the values of a file, which notes the attributes that were asked for."""

    def __init__(self, file: RexsFile):
        self.file, self.account = file, Account()
        self._asked: set[tuple[str, str]] = set()
        self._used: set[str] = set()

    def use(self, component: Component) -> None:
        """Note that a component has a part in the gearbox."""
        self._used.add(component.id)

    def _attribute(self, component: Component, name: str):
        self._asked.add((component.id, name))
        return component.attributes.get(name)

    def number(self, component: Component, name: str, unit: str, default: float | None = None) -> float:
        """Value of an attribute in an SI unit; ValueError with the line where it is missing or has another unit."""
        attribute = self._attribute(component, name)
        if attribute is None:
            require(default is not None, f"{component.title} of {self.file.path} lacks {name} [{unit}]; export it")
            return default  # type: ignore[return-value]
        where = f"{name} of {component.title} of {self.file.path}"
        value = self._scaled(attribute, attribute.value, unit, where)
        require(np.ndim(value) == 0, f"{where} must be a single number, got an array")
        return float(value)

    def vector(self, component: Component, name: str, unit: str) -> np.ndarray | None:
        """(n,) values of an array in an SI unit, None where it is missing."""
        attribute = self._attribute(component, name)
        if attribute is None:
            return None
        if isinstance(attribute.value, bool):
            self.account.left_out(component.title, f"{name} is no array in the file, but {attribute.value}")
            return None
        where = f"{name} of {component.title} of {self.file.path}"
        values = np.atleast_1d(self._scaled(attribute, attribute.value, unit, where))
        require(bool(np.isfinite(values).all()), f"{where} must be finite, got {text_of(values)}")
        return values

    def _scaled(self, attribute, value: Any, unit: str, where: str):
        where = f"{where} (line {attribute.line})"
        known = UNITS[unit]
        wrong = f"{where} has the unit {attribute.unit!r}, which is none of {[*known]}; export it in one of them"
        require(attribute.unit in known, wrong)
        try:
            scaled = np.asarray(value, float) * known[attribute.unit]
        except (TypeError, ValueError):
            raise ValueError(f"{where} must be a number, got {text_of(value)}") from None
        require(scaled.ndim > 0 or isfinite(scaled), f"{where} must be finite, got {text_of(value)}")
        return scaled

    def text(self, component: Component, name: str, default: str = "") -> str:
        """A name, a designation or a choice from a list."""
        attribute = self._attribute(component, name)
        return default if attribute is None else str(attribute.value)

    def flag(self, component: Component, name: str, default: bool = False) -> bool:
        """Whether an attribute is true; ValueError where it is neither true nor false."""
        text = self.text(component, name, str(default)).lower()
        choice = f"{name} of {component.title} of {self.file.path} must be true or false, got {text!r}"
        require(text in ("true", "false", "1", "0"), choice)
        return text in ("true", "1")

    def flags(self, component: Component, name: str, *, default: bool) -> list[bool]:
        """Whether each entry of an attribute, such as one for each gear of a shifted gearbox, is true."""
        attribute = self._attribute(component, name)
        if attribute is None:
            return [default]
        if isinstance(attribute.value, bool):
            self.account.assumed(component.title, f"{name} {default}, as it is no array in the file")
            return [default]
        return [str(value).lower() in ("true", "1", "1.0") for value in np.atleast_1d(attribute.value)]

    def has(self, component: Component, name: str) -> bool:
        """Whether a component has an attribute."""
        return self._attribute(component, name) is not None

    def parts_of(self, component: Component, *types: str) -> list[Component]:
        """Components of some types that are assembled on another, in the order that the file gives them."""
        relations = [*self.file.related("assembly", assembly=component.id)]
        relations += sorted(self.file.related("ordered_assembly", assembly=component.id), key=lambda x: x.order)
        parts = [self.file.components[x.roles["part"]] for x in relations if "part" in x.roles]
        return [part for part in parts if part.type in types]

    def owner_of(self, component: Component, *types: str) -> Component | None:
        """Component of some types on which another is assembled."""
        for type in ("assembly", "ordered_assembly"):
            for relation in self.file.related(type, part=component.id):
                owner = self.file.components[relation.roles["assembly"]]
                if owner.type in types:
                    return owner
        return None

    def referenced(self, component: Component, *types: str) -> list[Component]:
        """Components of some types, such as materials and tools, to which another refers."""
        referenced = []
        roles = {"reference": ("origin", "referenced"), "ordered_reference": ("origin", "referenced")}
        for type, (origin, target) in (roles | {"manufacturing_step": ("workpiece", "tool")}).items():
            for relation in self.file.related(type, **{origin: component.id}):
                related = self.file.components[relation.roles.get(target, component.id)]
                if related.type in types:
                    referenced.append(related)
        return referenced

    def close(self) -> None:
        """Note all components and attributes that nothing asked for, alike ones in a row."""
        groups: dict[tuple[str, str], list[Component]] = {}
        for component in self.file.components.values():
            left = [name for name in component.attributes if (component.id, name) not in self._asked]
            listed = ", ".join(name for name in left if name not in SILENT)
            asked = component.id in self._used or len(left) < len(component.attributes)
            text = listed if asked else f"not modelled{', with ' if listed else ''}{listed}"
            if text:
                groups.setdefault((component.type, text), []).append(component)
        for (type, text), components in groups.items():
            first = components[0].title
            self.account.left_out(first if len(components) == 1 else f"{len(components)} of {type}, {first}", text)
        changing: dict[str, tuple[str, dict[str, None]]] = {}
        for case in self.file.load_cases:
            for component in case.values():
                left = [name for name in component.attributes if (component.id, name) not in self._asked]
                changing.setdefault(component.id, (component.title, {}))[1].update(dict.fromkeys(left))
        for title, names in changing.values():
            if names:
                self.account.left_out(f"load cases, {title}", ", ".join(names))
        for words in self.file.unread:
            self.account.left_out("file", words)
