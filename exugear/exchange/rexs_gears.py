"""Gears of a REXS file: teeth, tools, bodies and flank modifications."""

from math import pi, tan
from typing import Any, NamedTuple

from exugear.exchange.rexs_file import Component
from exugear.exchange.rexs_reading import Reading
from fem.gear.gear import Gear
from fem.gear.material import STEEL, Material
from fem.gear.pinion_cutter import PinionCutter
from fem.microgeometry.flank import Sides
from fem.microgeometry.modification import LeadCrowning, ProfileCrowning, RootRelief, TipRelief
from fem.support.validation import require
from fem.units import mm, um

GEARS = "cylindrical_gear", "ring_gear"
#: Names of the flank in versions up to 1.2 and from 1.3 on.
FLANKS = "flank_geometry", "cylindrical_gear_flank"
THICKNESS = "normal_tooth_thickness_at_pitch_diameter"
MODIFICATIONS = "tip_relief", "root_relief", "profile_crowning", "helix_crowning", "helix_slope"
RACKS, CUTTERS = ("rack_shaped_tool",), ("cutter_wheel_tool",)
#: Share of the reference diameter below which a tip diameter is a placeholder.
PLACEHOLDER = 0.5
#: Largest clamp diameter below the root circle [modules], and share of it where no shaft section tells the bore.
RIM, BORE = 1.5, 0.5
#: Thickness of a ring's rim below the tooth roots where the file does not tell it [modules].
RING_RIM = 3.0


class ShaftAt(NamedTuple):
    """Diameters of a shaft at an axial position [m]; None where no section lies there."""

    outer: float | None
    inner: float | None


def material_of(reading: Reading, component: Component) -> Material:
    """The material to which a component refers, by default steel."""
    for material in reading.referenced(component, "material"):
        reading.use(material)
        return Material(
            E=reading.number(material, "elastic_modulus", "Pa", STEEL.E),
            nu=reading.number(material, "poisson_ratio", "1", STEEL.nu),
            density=reading.number(material, "density", "kg/m^3", STEEL.density),
        )
    reading.account.assumed(component.title, "steel, as it refers to no material")
    return STEEL


def density_of(reading: Reading, component: Component) -> float:
    """Density of the material to which a shaft refers [kg/m^3], by default that of steel."""
    for material in reading.referenced(component, "material"):
        reading.use(material)
        return reading.number(material, "density", "kg/m^3", STEEL.density)
    reading.account.assumed(component.title, "steel, as it refers to no material")
    return STEEL.density


def gear_of(reading: Reading, component: Component, shaft: ShaftAt, sense: int = 1) -> Gear:
    """The gear on a shaft with these diameters.

    sense   of its u axis along z: left and right flanks of the file are those seen from the end to which u points
    """
    reading.use(component)
    ring = component.type == "ring_gear" or reading.number(component, "number_of_teeth", "1") < 0
    z = int(abs(reading.number(component, "number_of_teeth", "1"))) * (-1 if ring else 1)
    m_n = reading.number(component, "normal_module", "m")
    beta = reading.number(component, "helix_angle_reference_diameter", "rad", 0.0)
    sizes: dict[str, Any] = {"z": z, "m_n": m_n, "b": reading.number(component, "face_width", "m"), "beta": beta}
    flanks = _flanks(reading, component)
    flank = flanks[0] if flanks else None
    sizes["alpha_n"] = _of_flank(reading, flank, "normal_pressure_angle", "rad", pi / 9, component)
    x = _shift(reading, component, flank, m_n, sizes["alpha_n"])
    sizes |= {"x": x, "material": material_of(reading, component)}
    if reading.has(component, THICKNESS):  # beside the profile shift, from which it differs by allowances
        sizes["s_n"] = reading.number(component, THICKNESS, "m")
    sizes |= given_diameters(reading, component)
    sizes |= _tool(reading, [component, *flanks], ring, m_n, has_root="d_f" in sizes)
    sizes |= _body(reading, component, shaft, Gear(**sizes | _placeholder_body(z, m_n, ring)))
    designed = [_modifications(reading, flank) for flank in flanks][::sense]
    unlike = len(designed) == 2 and designed[0] != designed[1]
    if unlike:
        reading.account.assumed(
            component.title, "left and right flanks as seen from the end to which its u axis points"
        )
    gear = Gear(**sizes, flank=Sides(*designed) if unlike else designed[0] if designed else ())
    reading.account.read(component.title, f"{gear}")
    return gear


def _flanks(reading: Reading, component: Component) -> list[Component]:
    """Left and right flank of a gear, which must have the same involute; none where the file holds none."""
    for relation in reading.file.related("flank", gear=component.id):
        sides = [reading.file.components.get(relation.roles.get(side, "")) for side in ("left", "right")]
        flanks = [flank for flank in sides if flank is not None]
        for flank in flanks:
            reading.use(flank)
        for name, unit in (("addendum_modification_coefficient", "1"), ("normal_pressure_angle", "rad")):
            values = [reading.number(flank, name, unit, 0.0) for flank in flanks]
            unlike = f"{name} of the flanks of {component.title} differ, {values}"
            require(not values or max(values) - min(values) < 1e-9, f"{unlike}; asymmetric teeth are not modelled")
        return flanks
    return []


def _of_flank(reading: Reading, flank, name: str, unit: str, default: float, component: Component) -> float:
    """A value of the flank, or of the gear itself, or the default, which is told."""
    for owner in (flank, component):
        if owner is not None and reading.has(owner, name):
            return reading.number(owner, name, unit)
    reading.account.assumed(component.title, f"{name} {default:.6g} {unit}")
    return default


def _shift(reading: Reading, component: Component, flank, m_n: float, alpha_n: float) -> float:
    """Profile shift coefficient, from the coefficient, the shift, or the tooth thickness."""
    for owner in (flank, component):
        if owner is None:
            continue
        if reading.has(owner, "addendum_modification_coefficient"):
            return reading.number(owner, "addendum_modification_coefficient", "1")
        if reading.has(owner, "addendum_modification"):
            return reading.number(owner, "addendum_modification", "m") / m_n
    if reading.has(component, THICKNESS):
        thickness = reading.number(component, THICKNESS, "m")
        return (thickness / m_n - pi / 2) / (2 * tan(alpha_n))
    reading.account.assumed(component.title, "no profile shift, x = 0")
    return 0.0


def given_diameters(reading: Reading, component: Component) -> dict[str, float]:
    """Tip and root diameter [m] where the file holds them; tiny ones are placeholders."""
    reference = abs(reading.number(component, "number_of_teeth", "1")) * reading.number(component, "normal_module", "m")
    sizes = {}
    for name, symbol in (("tip_diameter", "d_a"), ("root_diameter", "d_f")):
        if not reading.has(component, name):
            continue
        d = abs(reading.number(component, name, "m"))
        if d > PLACEHOLDER * reference:
            sizes[symbol] = d
        else:
            reading.account.left_out(component.title, f"{name} {d / mm:g} mm is a placeholder; that of the basic rack")
    return sizes


def _tool(reading: Reading, owners: list[Component], ring: bool, m_n: float, *, has_root: bool) -> dict:
    """Dedendum and fillet from the rack or the cutter to which the gear or its flanks refer."""
    for tool in (tool for owner in owners for tool in reading.referenced(owner, *RACKS, *CUTTERS)):
        reading.use(tool)
        height = reading.number(tool, "addendum_coefficient_reference_profile", "1", 0.0)
        rounding = reading.number(tool, "tip_radius_factor", "1", -1.0)
        sizes: dict = {} if has_root or not height else {"h_fP": height * m_n}
        if tool.type in CUTTERS and ring:
            teeth = int(reading.number(tool, "number_of_teeth", "1"))
            x_0 = reading.number(tool, "addendum_modification_coefficient", "1", 0.0)
            radius = {"rho_a0": rounding * m_n} if rounding > 0 else {}
            if not radius:
                reading.account.assumed(tool.title, "rounded tip of the cutter by default")
            return sizes | {"cutter": PinionCutter(z_0=teeth, x_0=x_0, **radius)}
        return sizes | ({"rho_f": rounding * m_n} if rounding > 0 and not ring else {})
    if not has_root:
        reading.account.assumed(owners[0].title, "basic rack ISO 53, profile A: dedendum 1.25 m_n")
    return {}


def _placeholder_body(z: int, m_n: float, ring: bool) -> dict[str, float]:
    """A body for the sizes that do not depend on it."""
    return {"d_rim": (abs(z) + 12) * m_n * 2} if ring else {"d_bore": 0.2 * abs(z) * m_n}


def _body(reading: Reading, component: Component, shaft: ShaftAt, gear: Gear) -> dict[str, float]:
    """Diameter where the body is clamped: the bore on its shaft, or the outside of a ring's rim."""
    if gear.internal:
        least = abs(gear.d_f) + 2 * gear.m_n
        if shaft.outer and shaft.outer > least:
            return {"d_rim": shaft.outer}
        rim = abs(gear.d_f) + 2 * RING_RIM * gear.m_n
        reading.account.assumed(component.title, f"rim of {RING_RIM:g} m_n, clamped at {rim / mm:.6g} mm")
        return {"d_rim": rim}
    largest = gear.d_f - 2 * RIM * gear.m_n
    if reading.has(component, "inner_diameter"):
        given = reading.number(component, "inner_diameter", "m")
        if 0 < given < largest:
            return {"d_bore": given}
    if shaft.outer and shaft.outer <= largest:
        return {"d_bore": shaft.outer}
    bore = min(largest, max(BORE * gear.d_f, 0.2 * gear.d_f))
    why = "it is one with its shaft" if shaft.outer else "no shaft section tells its bore"
    reading.account.assumed(component.title, f"body clamped at {bore / mm:.6g} mm, as {why}")
    return {"d_bore": bore}


def _modifications(reading: Reading, flank: Component) -> tuple:
    """Designed modifications of a flank; those that are not modelled stay in the account."""
    parts = [*reading.parts_of(flank, *MODIFICATIONS), *reading.referenced(flank, *MODIFICATIONS)]
    return tuple(modification for part in parts if (modification := _modification(reading, part)) is not None)


def _modification(reading: Reading, part: Component):
    """A modification of the flank, None where its amount is 0 or its shape is not modelled."""
    if part.type in ("tip_relief", "root_relief"):
        kind, amount, at = (TipRelief, "C_a", "d_Ca") if part.type == "tip_relief" else (RootRelief, "C_f", "d_Cf")
        depth = reading.number(part, f"{part.type}_depth", "m", 0.0)
        if depth == 0:
            return None
        d = reading.number(part, f"{part.type}_datum_diameter", "m")
        modification = kind(**{amount: depth, at: d})
    elif part.type == "profile_crowning":
        amounts = [reading.number(part, f"profile_crowning_at_{end}", "m", 0.0) for end in ("tip", "root")]
        modification = _even(reading, part, amounts, ProfileCrowning)
    elif part.type == "helix_crowning":
        ends = "datum_face", "non_datum_face"
        amounts = [reading.number(part, f"helix_crowning_amount_{end}", "m", 0.0) for end in ends]
        modification = _even(reading, part, amounts, LeadCrowning)
    else:
        modification = None
        reading.account.left_out(part.title, "its sign counts from the datum face, which is not read")
    if modification is not None:
        reading.use(part)
        reading.account.read(part.title, f"{modification}")
    return modification


def _even(reading: Reading, part: Component, amounts: list[float], kind):
    """A crowning of equal amounts at both ends; another one is left out in words."""
    if amounts[0] == amounts[1]:
        return kind(amounts[0]) if amounts[0] else None
    reading.account.left_out(part.title, f"amounts {amounts[0] / um:g} and {amounts[1] / um:g} um at its ends differ")
    return None
