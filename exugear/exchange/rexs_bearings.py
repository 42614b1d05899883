"""Bearings of a REXS file: linear stiffnesses, given or rigid, and rolling bearings by inner geometry or catalogue."""

from collections.abc import Sequence
from dataclasses import replace
from math import pi, radians
from typing import Any, NamedTuple

import numpy as np
import scipy

from exugear.exchange.rexs_file import Component
from exugear.exchange.rexs_reading import Reading
from exugear.gearbox.bearing import Bearing
from exugear.gearbox.rolling_bearing import RollingBearing
from fem.support.validation import require
from fem.units import mm

ROLLING = "rolling_bearing_with_catalog_geometry", "rolling_bearing_with_detailed_geometry"
BEARINGS = "concept_bearing", *ROLLING
#: Stiffness from which on files mean a rigid bearing [N/m, N m/rad], and those that stand for it.
RIGID, STIFF, STIFF_TILT = 1e12, 5e9, 1e7
#: Least stiffness that counts: files write 0 where they do not know it [N/m].
SOFT = 1e4
#: Stiffness of thrust washers of planets along their pins [N/m], which files do not hold.
GUIDANCE = 1e7
#: Damping over stiffness [s]: files do not hold it.
DAMPING_TIME = 1e-5
#: Radial displacements of a floating bearing's table, as shares of the largest.
TABLE = np.linspace(0.0, 1.0, 13) ** 1.5
#: Share of the dynamic capacity at which the stiffness is taken, and axial load over it of deep groove bearings.
LOAD_SHARE, AXIAL_SHARE = 0.1, 0.3
#: Largest displacement of the rings against each other [m].
FURTHEST = 0.5e-3
#: Outer over inner diameter, and width over the height of the section, where the file does not hold them.
OUTER_OVER_INNER, WIDTH_SHARE = 1.8, 0.45
#: Kinds of rolling bearings by a part of the type's name, the first that fits, and their usual contact angles [deg].
KINDS = {
    "angular_contact": "angular contact",
    "four_point": "angular contact",
    "tapered": "tapered roller",
    "roller": "cylindrical roller",
    "ball": "deep groove",
}
ANGLES = {"angular contact": 25.0, "tapered roller": 14.0}
#: Kinds that hold the shaft along its axis unless their outer ring is free, and the largest load of a floating bearing
#: over its dynamic capacity.
FIXING, LARGEST_SHARE = ("deep groove", "angular contact"), 0.6


class Options(NamedTuple):
    """How a file becomes a gearbox: with laws of rolling bearings or linear ones, with elastic shafts or rigid ones.

    step_angle   by which a tooth at the ring of a stepped planet stands ahead of one at the sun [rad]
    """

    rolling: bool = True
    elastic: bool = True
    step_angle: float = 0.0


def bearing_of(
    reading: Reading, component: Component, seat: float | None, *, rolling: bool, sense: int = 1
) -> Bearing | RollingBearing:
    """The bearing on a shaft.

    seat      diameter of the shaft there [m], None where it is not known
    rolling   whether rolling bearings of known geometry keep their force law, else they are linear
    sense     of the shaft's u axis along z
    """
    reading.use(component)
    held = reading.text(component, "axial_force_absorption", "both_directions")
    radial = _stiffness(reading, component, "radial_stiffness", "N/m", STIFF)
    axial = 0.0 if held == "no_direction" else _stiffness(reading, component, "axial_stiffness", "N/m", STIFF)
    tilt = _stiffness(reading, component, "bending_stiffness", "N m/rad", STIFF_TILT)
    reading.account.assumed(component.title, f"damping over stiffness {DAMPING_TIME:g} s")
    if component.type in ROLLING:
        bearing, known = _rolling(reading, component, seat, sense if held == "positive" else -sense)
        given = radial is not None and radial < STIFF  # files write "rigid" for the rings' seats
        if rolling and known and not given:
            law = _floating(bearing) if held == "no_direction" and bearing.kind in FIXING else bearing
            words = f"{bearing.kind} bearing by its force law{', free along its axis' if law is not bearing else ''}"
            reading.account.assumed(component.title, f"{words}; {bearing.estimate or 'inner geometry as in the file'}")
            reading.account.read(component.title, f"{law}")
            return law
        radial, axial, tilt = _linear(reading, component, bearing, held, (radial, axial, tilt))
    elif radial is None:
        carries = reading.flag(component, "radial_force_absorption", True)
        radial = STIFF if carries else 0.0
        if carries:
            reading.account.assumed(component.title, f"rigid in radial direction: {STIFF:g} N/m")
    if axial is None:
        axial = STIFF
        reading.account.assumed(component.title, f"rigid in axial direction: {STIFF:g} N/m")
    if held in ("positive", "negative") and axial:
        reading.account.assumed(component.title, "holds the shaft in both axial directions")
    linear = Bearing(radial=radial, axial=axial, tilt=tilt or 0.0, damping_time=DAMPING_TIME)
    reading.account.read(component.title, f"{linear}")
    return linear


def rolling_pin(reading: Reading, bearings: Sequence[tuple[Component, float]], sense: int) -> RollingBearing | None:
    """Rolling bearings of a planet on its pin as rows of one; None where they do not all have laws of the same kind.

    bearings   with their axial distances from the planet's gear [m]
    sense      of the planet's u axis along z
    """
    if any(component.type not in ROLLING for component, _ in bearings):
        return None
    noted = [*reading.account.rows]
    laws = [bearing_of(reading, component, None, rolling=True, sense=sense) for component, _ in bearings]
    alike = all(isinstance(law, RollingBearing) for law in laws) and len({(x.kind, x.C) for x in laws}) == 1  # type: ignore[union-attr]
    if not alike:
        reading.account.rows[:] = noted
        return None
    first: Any = laws[0]
    parts = zip(laws, (lever for _, lever in bearings), strict=True)
    rows = tuple(replace(row, axial=row.axial + lever) for law, lever in parts for row in law.rows)  # type: ignore[union-attr]
    guidance = 0.0
    if not first.stiffness[2, 2]:
        given = [_stiffness(reading, component, "axial_stiffness", "N/m", STIFF) for component, _ in bearings]
        guidance = next((value for value in given if value and value < STIFF), GUIDANCE)
        words = f"washers hold the planet along its pin with {guidance:.3g} N/m"
        reading.account.assumed(bearings[0][0].title, words)
    kind = first.kind if len(rows) == 1 else f"{first.kind}, {len(rows)} rows"
    return replace(first, kind=kind, rows=rows, guidance=guidance)


def _linear(
    reading: Reading, component: Component, bearing: RollingBearing, held: str, given: tuple
) -> tuple[float, float, float]:
    """Radial, axial and tilt stiffness of a rolling bearing, estimated where they are not given."""
    estimated_radial, estimated_axial = _estimated(reading, component, bearing)
    radial, axial, tilt = given
    radial = radial if radial and radial < STIFF else estimated_radial
    axial = 0.0 if held == "no_direction" else axial if axial and axial < STIFF else estimated_axial
    return radial, axial, 0.0 if tilt in (None, STIFF_TILT) else tilt


def _floating(bearing: RollingBearing) -> Bearing:
    """A ball bearing whose outer ring slides along its seat: radial force over displacement, as far as it is loaded."""
    most = LARGEST_SHARE * bearing.C

    def force(x: float) -> float:
        return abs(float(bearing.displaced([x, 0.0, 0.0, 0.0, 0.0]).force[0]))

    end = float(scipy.optimize.brentq(lambda x: force(x) - most, 0.0, FURTHEST, xtol=1e-10))
    displacements = (end * TABLE).tolist()
    return Bearing(table=(displacements, [force(x) for x in displacements]), damping_time=DAMPING_TIME)


def _stiffness(reading: Reading, component: Component, name: str, unit: str, stiff: float) -> float | None:
    """A given stiffness, that which stands for rigid, or None where it is 0 or missing."""
    value = reading.number(component, name, unit, 0.0)
    require(value >= 0, f"{name} of {component.title} must be >= 0 {unit}, got {value:g}")
    if value >= (RIGID if unit == "N/m" else RIGID / 1e3):
        if component.type not in ROLLING:
            reading.account.assumed(component.title, f"{name} {value:g} {unit} means rigid: {stiff:g} {unit}")
        return stiff
    return value if value >= (SOFT if unit == "N/m" else 1.0) else None


def _estimated(reading: Reading, component: Component, rolling: RollingBearing) -> tuple[float, float]:
    """Radial and axial stiffness [N/m] of a rolling bearing under a tenth of its capacity."""
    force = LOAD_SHARE * rolling.C
    by_radial = _stiffness_under(rolling, 0, force)
    words = f"{rolling.kind} bearing, linear under {force:.4g} N, a tenth of its capacity"
    reading.account.assumed(component.title, f"{words}; {rolling.estimate or 'inner geometry as in the file'}")
    if rolling.kind == "deep groove":
        return by_radial[0, 0], _stiffness_under(rolling, 2, AXIAL_SHARE * force)[2, 2]
    return by_radial[0, 0], by_radial[2, 2] if rolling.rows[0].alpha else 0.0


def _stiffness_under(rolling: RollingBearing, component: int, force: float) -> np.ndarray:
    """(5, 5) stiffness of a bearing that is displaced along x (0) or z (2) until it resists with a force [N].

    The shaft holds its rings parallel and, along x, its axial position: half of the elements then carry.
    """

    def displaced(share: float):
        return rolling.displaced([share if i == component else 0.0 for i in range(5)])

    at = scipy.optimize.brentq(lambda x: abs(displaced(x).force[component]) - force, 0.0, FURTHEST, xtol=1e-10)
    return np.abs(displaced(at).stiffness)


def _rolling(reading: Reading, component: Component, seat: float | None, direction: int) -> tuple[RollingBearing, bool]:
    """The rolling bearing, and whether the file holds its inner geometry or all boundary dimensions and capacities.

    What the file lacks follows from usual proportions. direction: of bearings with a contact angle.
    """
    type = reading.text(component, "bearing_type", "radial_grooved_ball_bearing")
    kind = next((kind for name, kind in KINDS.items() if name in type), "deep groove")
    if not any(name in type for name in KINDS):
        reading.account.assumed(component.title, f"{type} as a {kind} bearing")
    rows = reading.parts_of(component, "rolling_bearing_row")
    angles = [reading.number(row, "pressure_angle", "rad", 0.0) for row in rows]
    usual_angle = radians(ANGLES.get(kind, 0.0))
    alpha = (abs(angles[0]) if angles and angles[0] else usual_angle) if kind in ANGLES else 0.0
    if detailed := _detailed(reading, component, kind, rows, alpha, direction):
        return detailed, True
    d = reading.number(component, "inner_diameter", "m", 0.0) or seat or 0.0
    require(d > 0, f"{component.title} lacks inner_diameter, and its shaft has no section at its seat")
    outer = reading.number(component, "outer_diameter", "m", 0.0)
    width = reading.number(component, "width", "m", 0.0)
    capacities = [_capacity(reading, component, side) for side in ("dynamic", "static")]
    known = bool(outer and width and all(capacities))
    if not known:
        outer = outer or OUTER_OVER_INNER * d
        width = width or WIDTH_SHARE * (outer - d)
        usual = _usual_capacities(kind, d, outer, width)
        capacities = [given or assumed for given, assumed in zip(capacities, usual, strict=True)]
        sizes = f"D {outer / mm:.4g}, B {width / mm:.4g} mm, C {capacities[0]:.3g}, C_0 {capacities[1]:.3g} N"
        reading.account.assumed(
            component.title, f"{sizes} for a bore of {d / mm:.4g} mm, as the file lacks some of them"
        )
    boundary: dict[str, Any] = {"d": d, "D": outer, "B": width, "C": capacities[0], "C_0": capacities[1]}
    options: dict[str, Any] = {"alpha": alpha, "direction": direction, "damping_time": DAMPING_TIME}
    return RollingBearing.from_catalogue(kind, **boundary, **options), known


def _detailed(
    reading: Reading, component: Component, kind: str, rows: list[Component], alpha: float, direction: int
) -> RollingBearing | None:
    """The rolling bearing by the inner geometry of its single row; None where the file does not hold all of it."""
    if len(rows) != 1:
        return None
    row, elements = rows[0], reading.parts_of(rows[0], "rolling_element")
    Z = int(reading.number(row, "number_of_rolling_elements", "1", 0.0))
    D_pw = reading.number(row, "reference_diameter", "m", 0.0)
    D_w = reading.number(elements[0], "diameter_of_rolling_element", "m", 0.0) if elements else 0.0
    length = reading.number(elements[0], "length_of_rolling_element", "m", 0.0) if elements else 0.0
    if not (Z and D_pw and D_w) or ("roller" in kind and not length):
        return None
    for part in (row, elements[0]):
        reading.use(part)
    options: dict[str, Any] = {"Z": Z, "D_w": D_w, "D_pw": D_pw, "damping_time": DAMPING_TIME}
    options["C"] = _capacity(reading, component, "dynamic") or None
    clearances = "operating_radial_bearing_clearance", "radial_bearing_clearance"
    clearance = next((reading.number(component, x, "m") for x in clearances if reading.has(component, x)), 0.0)
    grooves = [reading.number(row, f"raceway_radius_of_{ring}_ring", "m", 0.0) for ring in ("inner", "outer")]
    if all(grooves) and "roller" not in kind:
        options |= {"r_i": grooves[0], "r_e": grooves[1]}
    if kind == "deep groove":
        return RollingBearing.deep_groove(**options, clearance=clearance)
    if kind == "cylindrical roller":
        return RollingBearing.cylindrical_roller(**options, L_we=length, clearance=clearance)
    options |= {"alpha": alpha, "direction": direction}
    if kind == "angular contact":
        return RollingBearing.angular_contact(**options)
    return RollingBearing.tapered_roller(**options, L_we=length)


def _capacity(reading: Reading, component: Component, side: str) -> float:
    """Dynamic or static capacity [N] by any of its names, 0 where the file lacks it."""
    names = f"{side}_capacity", f"{side}_load_rating", f"radial_{side}_load_rating"
    return next((reading.number(component, name, "N") for name in names if reading.has(component, name)), 0.0)


def _usual_capacities(kind: str, d: float, outer: float, width: float) -> tuple[float, float]:
    """Dynamic and static capacity [N] of a bearing of usual proportions (ISO 281, ISO 76)."""
    pitch, height, length = (outer + d) / 2 / mm, (outer - d) / mm, 0.6 * width / mm
    if kind in ("deep groove", "angular contact"):
        ball = 0.31 * height
        number = max(5, round(0.6 * pi * pitch / ball))
        return 75 * number ** (2 / 3) * ball**1.8, 12 * number * ball**2
    roller = 0.25 * height
    number = max(8, round(0.82 * pi * pitch / roller))
    dynamic = 90 * length ** (7 / 9) * number**0.75 * roller ** (29 / 27)
    return dynamic, 44 * (1 - roller / pitch) * number * length * roller
