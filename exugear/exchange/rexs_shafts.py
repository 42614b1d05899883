"""Shafts of a REXS file: their position, sections, and what lies where on them."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from exugear.exchange.rexs_bearings import BEARINGS, bearing_of
from exugear.exchange.rexs_file import Component
from exugear.exchange.rexs_gears import GEARS, ShaftAt
from exugear.exchange.rexs_reading import Reading
from exugear.gearbox.rolling_bearing import RollingBearing
from exugear.gearbox.shaft import Disc
from fem.support.validation import require
from fem.units import mm

#: Acceleration by gravity [m/s^2].
GRAVITY = 9.80665
#: Largest sine of the angle between axes that count as parallel, and least length of a piece of a shaft [m].
PARALLEL, SHORTEST = 1e-6, 1e-6
#: Relative change of the diameter of a cone from which on it is divided, and the number of its cylinders.
CONE, CYLINDERS = 0.05, 4
#: Most components to each of which the position of another one refers.
MOST_REFERENCES = 20


@dataclass
class ShaftLayout:
    """A shaft as it lies in the gearbox: x, y [m], z of its begin and sense of its u axis, and its sections.

    known             whether position and begin are those of the file, or follow from a stage
    axes              (3, 3) rows u, v, w of the shaft over those of the gear unit
    pieces            (begin, end, mean outer and inner diameter) of its sections along u [m]
    """

    component: Component
    name: str
    position: tuple[float, float] = (0.0, 0.0)
    begin: float = 0.0
    known: bool = False
    sense: int = 1
    pieces: list[tuple[float, float, float, float]] = field(default_factory=list)
    axes: np.ndarray = field(default_factory=lambda: np.eye(3))

    @property
    def sections(self) -> list[tuple[float, float, float, float]]:
        """(begin, end, mean outer and inner diameter) along z [m]."""
        ends = [(*sorted([self.axial(low), self.axial(high)]), *diameters) for low, high, *diameters in self.pieces]
        return [(begin, end, outer, inner) for begin, end, outer, inner in ends]

    def axial(self, u: float) -> float:
        """Axial position in the gearbox [m] of a coordinate u on the shaft."""
        return self.begin + self.sense * u

    def at(self, axial: float) -> ShaftAt:
        """Diameters at an axial position."""
        inside = [x for x in self.sections if x[0] - SHORTEST <= axial <= x[1] + SHORTEST]
        if not inside:
            return ShaftAt(None, None)
        return ShaftAt(max(x[2] for x in inside), min(x[3] for x in inside))

    def bare_discs(self, faces: list[tuple[float, float]], density: float) -> list[tuple[float, Disc]]:
        """The material of the sections outside the faces of the gears, which count the shaft below them."""
        discs = []
        for begin, end, outer, inner in self.sections:
            for low, high in _outside(begin, end, faces):
                discs.append(((low + high) / 2, Disc.cylinder(high - low, outer, inner, density)))
        return discs


def _outside(begin: float, end: float, faces: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """Parts of a range outside others."""
    parts = [(begin, end)]
    for low, high in faces:
        parts = [cut for a, b in parts for cut in ((a, min(b, low)), (max(a, high), b)) if cut[1] - cut[0] > SHORTEST]
    return parts


def position_of(reading: Reading, component: Component, depth: int = 0) -> np.ndarray | None:
    """(3,) position (u, v, w) [m] of a component in the gear unit, None where the file does not hold it."""
    position = reading.vector(component, "support_vector", "m")
    if position is None:
        return None
    require(position.shape == (3,), f"support_vector of {component.title} must hold 3 numbers, got {position.size}")
    reading.vector(component, "w_axis_vector", "m")
    reference = reading.file.components.get(reading.text(component, "reference_component_for_position"))
    if reference is None or reference.id == component.id or depth > MOST_REFERENCES:
        return position
    base = position_of(reading, reference, depth + 1)
    return position if base is None else position + base


def layout_of(reading: Reading, component: Component, name: str) -> ShaftLayout:
    """Where a shaft lies, with its sections. ValueError for an axis that is not parallel to u."""
    reading.use(component)
    position, axis = position_of(reading, component), reading.vector(component, "u_axis_vector", "m")
    layout = ShaftLayout(component, name)
    if position is not None:
        layout.begin, layout.position, layout.known = float(position[0]), (float(position[1]), float(position[2])), True
    if axis is not None:
        unit = axis / np.linalg.norm(axis)
        crossed = f"the axis of {component.title} lies along {np.round(unit, 6).tolist()}"
        require(bool(np.hypot(*unit[1:]) < PARALLEL), f"{crossed}; only shafts parallel to u are modelled")
        layout.sense = 1 if unit[0] > 0 else -1
        w = reading.vector(component, "w_axis_vector", "m")
        w = np.array([0.0, 0.0, 1.0]) if w is None or not np.any(w) else w / np.linalg.norm(w)
        layout.axes = np.array([unit, np.cross(w, unit), w])
    for section in reading.parts_of(component, "shaft_section"):
        reading.use(section)
        begin = reading.number(section, "u_coordinate_on_shaft", "m")
        length = reading.number(section, "length", "m")
        diameters = [
            [reading.number(section, f"{side}_diameter_{end}", "m", 0.0) for end in ("begin", "end")]
            for side in ("outer", "inner")
        ]
        if length > SHORTEST:
            layout.pieces += _cylinders(begin, length, *diameters)
    return layout


def _cylinders(
    begin: float, length: float, outer: list[float], inner: list[float]
) -> list[tuple[float, float, float, float]]:
    """(begin, end, outer and inner diameter) of the cylinders that stand for a cylinder or a cone."""
    conical = any(abs(x[1] - x[0]) > CONE * max(x) for x in (outer, inner))
    edges = np.linspace(0.0, 1.0, CYLINDERS + 1 if conical else 2)
    pieces = []
    for first, last in pairwise(edges):
        d, d_inner = (mean_diameter(*np.interp([first, last], [0, 1], ends)) for ends in (outer, inner))
        if d > d_inner:
            pieces.append((begin + first * length, begin + last * length, d, d_inner))
    return pieces


class Continuous(NamedTuple):
    """Axial position of the begin, (diameter, length, inner diameter) [m] of sections end to end, what is assumed."""

    start: float
    sections: list[tuple[float, float, float]]
    assumed: list[str]


def continuous(
    layout: ShaftLayout,
    needed: Iterable[float],
    gears: Iterable[tuple[float, float, float]],
    divided: Iterable[float] = (),
) -> Continuous | None:
    """The sections of a shaft end to end, from the first to the last of the positions that it must reach [m].

    gears     (begin, end, root diameter) of each gear, up to which its shaft is thick at most
    divided   positions at which sections end, alike as they may be

    Where sections overlap the outermost surface counts; gaps have the smaller diameter of both neighbours. None for a
    shaft without sections.
    """
    if not layout.sections:
        return None
    pieces, gears, assumed, divided = sorted(layout.sections), list(gears), [], np.array([*divided])
    low, high = min(x[0] for x in pieces), max(x[1] for x in pieces)
    first, last = min([low, *needed]), max([high, *needed])
    if low - first > SHORTEST or last - high > SHORTEST:
        assumed.append(f"sections extended to {first / mm:.4g} and {last / mm:.4g} mm, where parts lie beside them")
    edges = [
        first,
        last,
        *divided,
        *(x for piece in pieces for x in piece[:2]),
        *(x for gear in gears for x in gear[:2]),
    ]
    bounds = [x for x in np.unique(np.round(edges, 9)) if first - SHORTEST <= x <= last + SHORTEST]
    sections: list[tuple[float, float, float]] = []
    for begin, end in pairwise(bounds):
        middle = (begin + end) / 2
        inside = [x for x in pieces if x[0] < middle < x[1]]
        if not inside:
            before, after = [x for x in pieces if x[1] <= middle], [x for x in pieces if x[0] >= middle]
            beside = [*before[-1:], *after[:1]]
            inside = [min(beside, key=lambda x: x[2])]
            if low < middle < high:
                assumed.append(f"gap at {middle / mm:.4g} mm closed with a diameter of {inside[0][2] / mm:.4g} mm")
        d = min([max(x[2] for x in inside), *(root for a, b, root in gears if a < middle < b and root > 0)])
        d_inner = min(x[3] for x in inside)
        d_inner = d_inner if d_inner < d else 0.0
        alike = sections and sections[-1][0] == d and sections[-1][2] == d_inner
        if alike and not (np.abs(divided - begin) < SHORTEST).any():
            sections[-1] = (d, sections[-1][1] + end - begin, d_inner)
        elif end - begin > SHORTEST:
            sections.append((d, end - begin, d_inner))
    return Continuous(
        float(bounds[0]), [(float(d), float(length), float(d_inner)) for d, length, d_inner in sections], assumed
    )


def mean_diameter(begin: float, end: float) -> float:
    """Diameter of the cylinder with the volume of a cone [m]."""
    return float(np.sqrt((begin**2 + begin * end + end**2) / 3))


def gear_position(reading: Reading, layout: ShaftLayout, component: Component) -> float:
    """Axial position of a gear's mid-plane [m]: that of its own position, or from its coordinate on the shaft.

    In version 1.0 this coordinate is that of the first face.
    """
    position, u = position_of(reading, component), u_of_gear(reading, component)
    return layout.axial(u) if position is None else float(position[0])


def u_of_gear(reading: Reading, component: Component) -> float:
    """Coordinate of a gear's mid-plane on its shaft [m]."""
    half = reading.number(component, "face_width", "m") / 2 if reading.file.version == "1.0" else 0.0
    return reading.number(component, "u_coordinate_on_shaft", "m", 0.0) + half


@dataclass
class SeatOnShaft:
    """A bearing between two shafts: that which it carries, and the one that its seat moves with.

    mirrored   whether the shaft that it carries has its outer ring
    axial      position of the bearing [m], once it is read
    """

    carried: ShaftLayout
    carrying: ShaftLayout
    mirrored: bool
    axial: float


def seats_on_shafts(reading: Reading, layouts: Iterable[ShaftLayout]) -> dict[str, SeatOnShaft]:
    """Bearings between two of some shafts, by the id of their component.

    A bearing carries the shaft that has none in the housing, say an idler gear's, else that with its inner ring.
    Between shafts that both have none it is left to the housing.
    """
    by_id, housed, between = {layout.component.id: layout for layout in layouts}, set(), {}
    for relation in reading.file.related("side"):
        component = reading.file.components.get(relation.roles.get("assembly", ""))
        parts = [by_id.get(relation.roles.get(f"{ring}_part", "")) for ring in ("inner", "outer")]
        if component is None or component.type not in BEARINGS:
            continue
        inner, outer = parts
        if inner is not None and outer is not None:
            between[component.id] = inner, outer
        elif inner is not None:
            housed.add(inner.name)
    seats = {}
    for id, (inner, outer) in between.items():
        mirrored = outer.name not in housed
        carried, carrying = (outer, inner) if mirrored else (inner, outer)
        apart = float(np.hypot(*np.subtract(inner.position, outer.position)))
        if carrying.name in housed and apart < SHORTEST:
            u = reading.number(reading.file.components[id], "u_coordinate_on_shaft_inner_side", "m")
            seats[id] = SeatOnShaft(carried, carrying, mirrored, inner.axial(u))
    return seats


def bearings_of(
    reading: Reading,
    layout: ShaftLayout,
    *,
    rolling: bool,
    planets: Iterable[Component] = (),
    seats: Mapping[str, SeatOnShaft] | None = None,
) -> dict[float, object]:
    """Bearings of a shaft by axial position [m].

    One against another shaft that is not among the seats counts as one in the housing.

    rolling   as of `bearing_of`
    planets   shafts whose bearings belong to the pins of a carrier
    seats     bearings between shafts by the ids of their components, whose positions are noted
    """
    on_pins = [planet.id for planet in planets]
    bearings: dict[float, object] = {}
    for relation in reading.file.related("side"):
        component = reading.file.components[relation.roles.get("assembly", layout.component.id)]
        seat = (seats or {}).get(component.id)
        ours = relation.roles.get("inner_part") == layout.component.id if seat is None else seat.carried is layout
        if not ours or component.type not in BEARINGS or relation.roles.get("outer_part") in on_pins:
            continue
        if seat is not None:
            bearings[_free(seat.axial, bearings)] = _between_shafts(reading, component, seat, rolling=rolling)
            seat.axial = [*bearings][-1]
            continue
        axial = layout.axial(reading.number(component, "u_coordinate_on_shaft_inner_side", "m"))
        reading.number(component, "u_coordinate_on_shaft_outer_side", "m", 0.0)
        position_of(reading, component)
        reading.vector(component, "u_axis_vector", "m")
        outer = reading.file.components.get(relation.roles.get("outer_part", ""))
        if outer is not None and outer.type == "shaft":
            why = "which has no bearing in the housing itself, or belongs to a planetary set"
            apart = f"stands in the housing instead of on {outer.title}, {why}"
            reading.account.assumed(component.title, apart)
        elif outer is not None:
            reading.use(outer)
        bearing = bearing_of(reading, component, layout.at(axial).outer, rolling=rolling, sense=layout.sense)
        bearings[_free(axial, bearings)] = bearing
    return bearings


def _between_shafts(reading: Reading, component: Component, seat: SeatOnShaft, *, rolling: bool) -> object:
    """A bearing between two shafts; by its law only where this knows no difference between inner and outer ring."""
    reading.number(component, "u_coordinate_on_shaft_outer_side", "m", 0.0)
    position_of(reading, component)
    reading.vector(component, "u_axis_vector", "m")
    carried, carrying = seat.carried, seat.carrying
    inner = carrying if seat.mirrored else carried
    diameter = inner.at(seat.axial).outer
    bearing = bearing_of(reading, component, diameter, rolling=rolling, sense=inner.sense)
    even = not isinstance(bearing, RollingBearing) or bearing.kind == "cylindrical roller"
    if seat.mirrored and not even:
        bearing = bearing_of(reading, component, diameter, rolling=False, sense=inner.sense)
        reading.account.assumed(component.title, "linear, as the shaft that it carries has its outer ring")
    words = f"stands on {carrying.component.title} and carries {carried.component.title}"
    reading.account.read(component.title, words)
    return bearing


def _free(axial: float, bearings: dict[float, object]) -> float:
    """The axial position, moved by a micrometre where a bearing stands already."""
    while axial in bearings:
        axial += SHORTEST
    return axial


def torque_position(reading: Reading, layout: ShaftLayout) -> float | None:
    """Axial position [m] of the outside load that transmits torque, None without one."""
    for load in reading.parts_of(layout.component, "external_load"):
        if reading.flag(load, "transmits_torque") and reading.has(load, "u_coordinate_on_shaft"):
            return layout.axial(reading.number(load, "u_coordinate_on_shaft", "m"))
    return None


def gravity_of(reading: Reading) -> tuple[float, float, float]:
    """Acceleration (x, y, z) [m/s^2] by gravity where the gear unit accounts for it."""
    for unit in reading.file.of_type("gear_unit"):
        if reading.flag(unit, "account_for_gravity"):
            u, v, w = (reading.number(unit, f"direction_vector_gravity_{x}", "1", 0.0) for x in "uvw")
            size = float(np.hypot(np.hypot(u, v), w))
            if size > 0:
                reading.account.read(unit.title, f"gravity along ({u:g}, {v:g}, {w:g})")
                return tuple(GRAVITY * x / size for x in (v, w, u))  # type: ignore[return-value]
            reading.account.left_out(unit.title, "gravity without a direction")
    return 0.0, 0.0, 0.0


def gears_on(reading: Reading, component: Component) -> list[Component]:
    """Gears of a shaft in the order of the file."""
    return reading.parts_of(component, *GEARS)


def masses_of(reading: Reading, layout: ShaftLayout) -> list[tuple[float, Disc]]:
    """Additional masses of a shaft as discs."""
    discs = []
    for part in reading.parts_of(layout.component, "additional_mass"):
        mass = reading.number(part, "mass_of_component", "kg", 0.0)
        polar = reading.number(part, "moment_of_inertia_u_axis", "kg m^2", 0.0)
        axial = layout.axial(reading.number(part, "u_coordinate_on_shaft", "m", 0.0))
        if mass > 0 and polar > 0:
            reading.use(part)
            transverse = reading.number(part, "moment_of_inertia_v_axis", "kg m^2", 0.0) or polar / 2
            discs.append((axial, Disc(mass, polar, transverse)))
            reading.account.read(part.title, f"disc of {mass:g} kg at {axial / mm:g} mm")
    return discs
