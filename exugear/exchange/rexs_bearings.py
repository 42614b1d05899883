"""Bearings of a REXS file as linear stiffnesses: given, rigid, or estimated from the boundary dimensions."""

from math import cos, inf, pi, radians, sin
from typing import NamedTuple

from exugear.exchange.rexs_file import Component
from exugear.exchange.rexs_reading import Reading
from exugear.gearbox.bearing import Bearing
from fem.support.validation import require
from fem.units import mm

ROLLING = "rolling_bearing_with_catalog_geometry", "rolling_bearing_with_detailed_geometry"
BEARINGS = "concept_bearing", *ROLLING
#: Stiffness from which on files mean a rigid bearing [N/m, N m/rad], and those that stand for it.
RIGID, STIFF, STIFF_TILT = 1e12, 5e9, 1e7
#: Least stiffness that counts: files write 0 where they do not know it [N/m].
SOFT = 1e4
#: Damping over stiffness [s]: files do not hold it.
DAMPING_TIME = 1e-5
#: Share of the dynamic capacity at which the stiffness is taken, and axial over radial stiffness of deep groove balls.
LOAD_SHARE, AXIAL_SHARE = 0.1, 0.3
#: Outer over inner diameter where only the shaft's seat is known.
OUTER_OVER_INNER = 1.8
#: Contact angles by type [deg] where the rows do not hold them.
ANGLES = {"angular_contact": 25.0, "four_point": 35.0, "tapered": 14.0}


class BoundaryDimensions(NamedTuple):
    """Bore, outside diameter and width [m], dynamic capacity [N] or None, contact angle [rad]."""

    d: float
    D: float
    B: float
    C: float | None
    alpha: float


def bearing_of(reading: Reading, component: Component, seat: float | None) -> Bearing:
    """The bearing on a shaft whose diameter at its seat is known or None."""
    reading.use(component)
    held = reading.text(component, "axial_force_absorption", "both_directions")
    one_way = held in ("positive", "negative")
    radial = _stiffness(reading, component, "radial_stiffness", "N/m", STIFF)
    axial = 0.0 if held == "no_direction" else _stiffness(reading, component, "axial_stiffness", "N/m", STIFF)
    tilt = _stiffness(reading, component, "bending_stiffness", "N m/rad", STIFF_TILT)
    if component.type in ROLLING:
        estimated_radial, estimated_axial = _estimated(reading, component, seat)
        # files write "rigid" for the rings' seats: the rolling elements are softer
        radial = radial if radial and radial < STIFF else estimated_radial
        axial = 0.0 if held == "no_direction" else axial if axial and axial < STIFF else estimated_axial
        tilt = 0.0 if tilt in (None, STIFF_TILT) else tilt
    elif radial is None:
        given = reading.flag(component, "radial_force_absorption", True)
        radial = STIFF if given else 0.0
        if given:
            reading.account.assumed(component.title, f"rigid in radial direction: {STIFF:g} N/m")
    if axial is None:
        axial = STIFF
        reading.account.assumed(component.title, f"rigid in axial direction: {STIFF:g} N/m")
    if one_way and axial:
        reading.account.assumed(component.title, "holds the shaft in both axial directions")
    reading.account.assumed(component.title, f"damping over stiffness {DAMPING_TIME:g} s")
    bearing = Bearing(radial=radial, axial=axial, tilt=tilt or 0.0, damping_time=DAMPING_TIME)
    reading.account.read(component.title, f"{bearing}")
    return bearing


def _stiffness(reading: Reading, component: Component, name: str, unit: str, stiff: float) -> float | None:
    """A given stiffness, that which stands for rigid, or None where it is 0 or missing."""
    value = reading.number(component, name, unit, 0.0)
    require(value >= 0, f"{name} of {component.title} must be >= 0 {unit}, got {value:g}")
    if value >= (RIGID if unit == "N/m" else RIGID / 1e3):
        if component.type not in ROLLING:
            reading.account.assumed(component.title, f"{name} {value:g} {unit} means rigid: {stiff:g} {unit}")
        return stiff
    return value if value >= (SOFT if unit == "N/m" else 1.0) else None


def _estimated(reading: Reading, component: Component, seat: float | None) -> tuple[float, float]:
    """Radial and axial stiffness [N/m] of a rolling bearing from its boundary dimensions.

    Number and size of the rolling elements follow the usual proportions; the deflection is Palmgren's (Ball and Roller
    Bearing Engineering, 1959). Within a factor of 2.
    """
    kind = reading.text(component, "bearing_type", "radial_grooved_ball_bearing")
    size = _dimensions(reading, component, seat, kind)
    if "ball" in kind:
        radial, axial = ball_stiffness(size)
        deep_groove = "grooved" in kind or "self_aligning" in kind
        axial = AXIAL_SHARE * radial if deep_groove else axial
    else:
        radial, axial = roller_stiffness(size)
    words = f"{kind}: radial {radial:.3g}, axial {axial:.3g} N/m, within a factor of 2"
    reading.account.assumed(component.title, f"{words}, by Palmgren at a tenth of the capacity")
    return radial, axial


def _dimensions(reading: Reading, component: Component, seat: float | None, kind: str) -> BoundaryDimensions:
    d = reading.number(component, "inner_diameter", "m", 0.0) or seat or 0.0
    require(d > 0, f"{component.title} lacks inner_diameter, and its shaft has no section at its seat")
    outer = reading.number(component, "outer_diameter", "m", 0.0)
    if not outer:
        outer = OUTER_OVER_INNER * d
        reading.account.assumed(component.title, f"outside diameter {outer / mm:.4g} mm for a bore of {d / mm:.4g} mm")
    require(outer > d, f"outer_diameter of {component.title} must exceed its bore, got {outer / mm:g}, {d / mm:g} mm")
    width = reading.number(component, "width", "m", 0.0) or 0.45 * (outer - d)
    names = "dynamic_capacity", "dynamic_load_rating"
    capacity = next((reading.number(component, name, "N") for name in names if reading.has(component, name)), None)
    angles = [
        reading.number(row, "pressure_angle", "rad", 0.0) for row in reading.parts_of(component, "rolling_bearing_row")
    ]
    by_type = next((radians(angle) for name, angle in ANGLES.items() if name in kind), 0.0)
    alpha = abs(angles[0]) if angles and angles[0] else by_type
    return BoundaryDimensions(d, outer, width, capacity or None, alpha)


def ball_stiffness(size: BoundaryDimensions) -> tuple[float, float]:
    """Radial and axial stiffness [N/m] of a ball bearing; the axial one is infinite without a contact angle."""
    ball, pitch = 0.31 * (size.D - size.d) / mm, (size.D + size.d) / 2 / mm
    number = max(5, round(0.6 * pi * pitch / ball))
    capacity = size.C or 75 * number ** (2 / 3) * ball**1.8
    force = LOAD_SHARE * capacity

    def deflection(share: float, at: float) -> float:
        load = share * force / (number * at)
        return 4.37e-4 / at * (load**2 / ball) ** (1 / 3) * mm

    radial = 1.5 * force / deflection(5.0, cos(size.alpha))
    axial = 1.5 * force / deflection(1.0, sin(size.alpha)) if size.alpha > 0 else inf
    return radial, axial


def roller_stiffness(size: BoundaryDimensions) -> tuple[float, float]:
    """Radial and axial stiffness [N/m] of a roller bearing; the axial one is 0 without a contact angle."""
    roller, pitch, length = 0.27 * (size.D - size.d) / mm, (size.D + size.d) / 2 / mm, 0.6 * size.B / mm
    number = max(8, round(0.85 * pi * pitch / roller))
    capacity = size.C or 90 * length ** (7 / 9) * number**0.75 * roller ** (29 / 27)
    force = LOAD_SHARE * capacity

    def deflection(share: float, at: float) -> float:
        return 7.68e-5 / at * (share * force / (number * at)) ** 0.9 / length**0.8 * mm

    radial = force / (0.9 * deflection(4.08, cos(size.alpha)))
    axial = force / (0.9 * deflection(1.0, sin(size.alpha))) if size.alpha > 0 else 0.0
    return radial, axial
