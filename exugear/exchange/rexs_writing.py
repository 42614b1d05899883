"""Gearboxes written as REXS files of version 1.4 in XML, for other programs."""

from collections.abc import Iterable
from dataclasses import replace
from math import atan2, pi
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from exugear.exchange.rexs_reading import Account
from exugear.exchange.rexs_shafts import GRAVITY
from exugear.gearbox.bearing import Bearing
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.rolling_bearing import RollingBearing
from exugear.gearbox.shaft import Disc, Shaft, parts_of
from exugear.gearbox.shaft_loads import ExternalForce
from exugear.gearbox.stage import Stage
from exugear.mesh_force.ring_pair import RingPair
from exugear.operation.load_spectrum import LoadCase
from exugear.rolling_bearings.rows import BallRow, RollerRow, Row
from fem.gear.gear import Gear
from fem.microgeometry.flank import Sides
from fem.microgeometry.modification import LeadCrowning, ProfileCrowning, RootRelief, TipRelief
from fem.support.arguments import DERIVED, FilePath, checked
from fem.support.cache import complete_file
from fem.support.validation import require
from fem.support.version import __version__
from fem.units import GPa, deg, mm

VERSION = "1.4"
#: Suffixes of the containers of REXS that are read but not written.
NOT_XML = ".rexsj", ".json", ".rexsz", ".zip"
#: Units of REXS, and the SI values of one of them.
UNITS = {
    "mm": mm,
    "deg": deg,
    "1 / min": pi / 30,
    "N": 1.0,
    "N m": 1.0,
    "N / m": 1.0,
    "N mm / rad": 1e-3,
    "N / mm^2": 1e6,
    "kg / dm^3": 1e3,
    "kg": 1.0,
    "kg m^2": 1.0,
    "%": 1e-2,
    "none": 1.0,
}
#: Relative difference of masses that is rounding; difference of an acceleration from gravity that is none [m/s^2].
ROUNDING, LIKE_GRAVITY = 1e-9, 0.01
Value = tuple[object, str]
#: Types of rolling bearings by their kinds.
TYPES = {
    "deep groove": "radial_grooved_ball_bearing",
    "angular contact": "angular_contact_ball_bearing",
    "cylindrical roller": "cylindrical_roller_bearing",
    "needle": "radial_needle_roller_bearing",
    "tapered roller": "tapered_roller_bearing",
}


@checked
def write_rexs(path: FilePath, gearbox: Gearbox, load_cases: Iterable[LoadCase] = ()) -> Account:
    """Write a gearbox of cylindrical stages to a REXS file of version 1.4 in XML, whole or not at all.

    load_cases   as `exugear.read_rexs` returns them; speed and torque of the driving shaft and the share of time are
                 written, torques on further shafts and forces of a case are left out

    Sections, rolling bearings of one row by their inner geometry, external forces and gravity are written, too. Returns
    an account of what REXS cannot hold, or this function does not write: force laws, damping, friction, couplings,
    drags, unbalance, bearings with clearance, guidance, rims of rings, offsets of shafts, masses and inertias beyond
    those of their parts. Raises ValueError for gearboxes with planetary sets or a `RingPair`, and for names that say
    JSON or a zip archive.
    """
    suffix = Path(path).suffix
    require(suffix.lower() not in NOT_XML, f"path must name an XML file, say gearbox.rexs, got the suffix {suffix!r}")
    sets = [stage.name for stage in gearbox.stages if stage.carrier is not None]
    require(not sets, f"planetary sets are not written, got {sets}; write the parallel stages alone")
    ringed = [stage.name for stage in gearbox.stages if isinstance(stage.pair, RingPair)]
    remedy = "whose ring has no body; give a fem.GearPair with the ring as a fem.Gear"
    require(not ringed, f"stages {ringed} have a RingPair, {remedy}")
    writing = _Writing()
    writing.gearbox(gearbox)
    writing.load_spectrum(gearbox, list(load_cases))
    tree = writing.tree()
    ElementTree.indent(tree)
    with complete_file(Path(path)) as file:
        file.write(ElementTree.tostring(tree, encoding="utf-8", xml_declaration=True))
    return writing.account


class _Writing:
    """Components, relations and load cases as elements, numbered from 1 on."""

    def __init__(self):
        self.account = Account()
        self.components = ElementTree.Element("components")
        self.relations = ElementTree.Element("relations")
        self.cases: ElementTree.Element | None = None
        self.shafts: dict[str, str] = {}
        self.gears: dict[tuple[str, float], str] = {}
        self.begins: dict[str, float] = {}
        self.unit = self._component("gear_unit", "gear unit", support_vector=(np.zeros(3), "mm"))
        self.casing = self._component("gear_casing", "housing")
        self._relation("assembly", assembly=self.unit, part=self.casing)

    def tree(self) -> ElementTree.Element:
        """The whole file."""
        model = ElementTree.Element("model", applicationId="exugear", applicationVersion=__version__, version=VERSION)
        model.extend([self.relations, self.components, *([] if self.cases is None else [self.cases])])
        return model

    def _component(self, type: str, name: str, **attributes: Value) -> str:
        id = str(len(self.components) + 1)
        element = ElementTree.SubElement(self.components, "component", id=id, name=name, type=type)
        _add(element, attributes)
        return id

    def _relation(self, type: str, **roles: str) -> None:
        id = str(len(self.relations) + 1)
        relation = ElementTree.SubElement(self.relations, "relation", id=id, type=type)
        types = {component.get("id"): component.get("type") for component in self.components}
        for role, target in roles.items():
            ElementTree.SubElement(relation, "ref", hint=types[target] or "", id=target, role=role)

    def gearbox(self, gearbox: Gearbox) -> None:
        """All shafts with their parts, and the stages between them."""
        self._gravity(gearbox)
        for seat, (on, _) in gearbox.between.items():
            words = f"its seat on shaft {on!r} is not written, it stands in the housing"
            self.account.left_out(f"{seat[0]} at {seat[1] / mm:g} mm", words)
        if gearbox.housing is not None:
            self.account.left_out("housing", f"stiffness between {len(gearbox.housing.seats)} seats is not written")
        for shaft in gearbox.shafts:
            loaded = shaft is gearbox.driving or shaft is gearbox.driven
            at = gearbox.shaft_positions[shaft.name]
            self._shaft(shaft, at, drives=shaft is gearbox.driving, loaded=loaded)
        for stage in gearbox.stages:
            self._stage(stage, gearbox.shaft_positions)

    def _shaft(self, shaft: Shaft, position: tuple[float, float], *, drives: bool, loaded: bool) -> None:
        """A shaft with its parts; drives, loaded: whether its speed is given, and whether drive or load act on it."""
        begin = min(axial - getattr(part, "b", 0.0) / 2 for axial, part in parts_of(shaft))
        begin = shaft.start if shaft.sections else begin
        id = self._component(
            "shaft", shaft.name, **_placed(np.array([begin, *position])), defines_speed=(drives, "none")
        )
        self.shafts[shaft.name] = id
        self.begins[shaft.name] = begin
        self._relation("assembly", assembly=self.unit, part=id)
        self._sections(shaft, id)
        for axial, part in parts_of(shaft):
            at, where = np.array([axial, *position]), f"{shaft.name} at {axial / mm:g} mm"
            if isinstance(part, Gear):
                self.gears[shaft.name, axial] = self._gear(part, at, axial - begin, where, id)
            elif isinstance(part, Bearing):
                self._bearing(part, at, axial - begin, where, id)
            elif isinstance(part, RollingBearing):
                self._rolling_bearing(part, at, axial - begin, where, id)
            elif isinstance(part, ExternalForce):
                self._force(part, axial - begin, where, id)
            elif isinstance(part, Disc):
                sizes = {"mass_of_component": (part.mass, "kg"), "moment_of_inertia_u_axis": (part.inertia, "kg m^2")}
                sizes |= {"moment_of_inertia_v_axis": (part.transverse, "kg m^2")}
                mass = self._component("additional_mass", where, u_coordinate_on_shaft=(axial - begin, "mm"), **sizes)
                self._relation("assembly", assembly=id, part=mass)
            else:
                self.account.left_out(where, f"{type(part).__name__} is not written")
        of_parts = [sum(getattr(disc, name) for _, disc in shaft.bodies) for name in ("mass", "inertia")]
        if not np.allclose((shaft.mass, shaft.inertia), of_parts, rtol=ROUNDING, atol=0.0):
            remark = "beyond those of its parts are not written; add a Disc"
            self.account.left_out(
                shaft.name, f"mass {shaft.mass:.4g} kg and inertia {shaft.inertia:.4g} kg m^2 {remark}"
            )
        elif not np.isclose(shaft.transverse, replace(shaft, transverse=DERIVED).transverse, rtol=ROUNDING, atol=0.0):
            words = f"transverse inertia {shaft.transverse:.4g} kg m^2 beside that of its parts is not written"
            self.account.left_out(shaft.name, words)
        if shaft.offset != type(shaft.offset)():
            self.account.left_out(shaft.name, f"{shaft.offset} is not written")
        if shaft.sections and shaft.damping_ratio != Shaft.damping_ratio:
            self.account.left_out(shaft.name, f"damping_ratio {shaft.damping_ratio:g} of its modes is not written")
        if shaft.torque_at is not None and not loaded:
            self.account.left_out(shaft.name, f"torque_at {shaft.torque_at / mm:g} mm is not written")

    def _gravity(self, gearbox: Gearbox) -> None:
        """Direction of the gravity of the shafts on bearings, which must be the same."""
        acting = {tuple(shaft.gravity) for shaft in gearbox.shafts if shaft.bearings}
        if len(acting) > 1:
            self.account.left_out("gravity", f"is not written, it differs between the shafts: {sorted(acting)}")
        elif any(any(gravity) for gravity in acting):
            x, y, z = next(iter(acting))
            direction: dict[str, Value] = {
                f"direction_vector_gravity_{axis}": (value, "none")
                for axis, value in zip("uvw", (z, x, y), strict=True)
            }
            _add(self.components[int(self.unit) - 1], {"account_for_gravity": (True, "none")} | direction)
            size = float(np.linalg.norm([x, y, z]))
            if abs(size - GRAVITY) > LIKE_GRAVITY:
                remark = f"{GRAVITY:g} m/s^2 is read, as REXS holds the direction alone"
                self.account.left_out("gravity", f"size {size:.4g} m/s^2 is not written: {remark}")

    def _sections(self, shaft: Shaft, id: str) -> None:
        """Sections of a shaft, and its material."""
        for section in shaft.cylinders:
            ends = {"outer": section.d, "inner": section.d_inner}
            sizes: dict[str, Value] = {
                f"{side}_diameter_{end}": (d, "mm") for side, d in ends.items() for end in ("begin", "end")
            }
            sizes |= {"u_coordinate_on_shaft": (section.start - shaft.start, "mm"), "length": (section.length, "mm")}
            self._relation("assembly", assembly=id, part=self._component("shaft_section", "section", **sizes))
        if shaft.sections:
            self._relation("reference", origin=id, referenced=self._material(shaft))

    def _force(self, force: ExternalForce, u: float, where: str, shaft: str) -> None:
        """An external force; x, y, z of it are v, w, u of the file."""
        directions = {"force_v": force.x, "force_w": force.y, "force_u": force.z}
        values: dict[str, Value] = {f"{name}_direction": (value, "N") for name, value in directions.items() if value}
        moments = {"torque_around_v_axis": force.moment_x, "torque_around_w_axis": force.moment_y}
        values |= {name: (value, "N m") for name, value in moments.items() if value}
        at: dict[str, Value] = {"u_coordinate_on_shaft": (u, "mm"), "transmits_torque": (False, "none")}
        load = self._component("external_load", f"force on {where}", **at, **values)
        self._relation("assembly", assembly=shaft, part=load)

    def _rolling_bearing(self, bearing: RollingBearing, at: np.ndarray, u: float, where: str, shaft: str) -> None:
        """A rolling bearing of one row by its inner geometry."""
        if len(bearing.rows) > 1 or bearing.kind not in TYPES:
            self.account.left_out(where, f"{bearing} is not written: kind {bearing.kind!r}, rows {len(bearing.rows)}")
            return
        row = bearing.rows[0]
        values: dict[str, Value] = {"bearing_type": (TYPES[bearing.kind], "none"), "dynamic_capacity": (bearing.C, "N")}
        values |= {"u_coordinate_on_shaft_inner_side": (u, "mm")}
        absorbs = "no_direction" if bearing.kind in ("cylindrical roller", "needle") else "both_directions"
        absorbs = ("positive" if row.direction > 0 else "negative") if row.alpha else absorbs
        values |= {"axial_force_absorption": (absorbs, "none")}
        of_row: dict[str, Value] = {
            "number_of_rolling_elements": (row.Z, "none"),
            "reference_diameter": (row.D_pw, "mm"),
        }
        of_row |= {"pressure_angle": (row.alpha, "deg")}
        of_element: dict[str, Value] = {"diameter_of_rolling_element": (row.D_w, "mm")}
        if isinstance(row, BallRow):
            of_row |= {"raceway_radius_of_inner_ring": (row.r_i, "mm"), "raceway_radius_of_outer_ring": (row.r_e, "mm")}
            clearance = 2 * (row.A - row.R_0)
        elif isinstance(row, RollerRow):
            of_element |= {"length_of_rolling_element": (row.L_we, "mm")}
            clearance = 2 * row.gap
        if not row.alpha and clearance:
            values |= {"operating_radial_bearing_clearance": (clearance, "mm")}
        id = self._component("rolling_bearing_with_detailed_geometry", where, **_placed(at), **values)
        self._relation("assembly", assembly=self.unit, part=id)
        self._relation("side", assembly=id, inner_part=shaft, outer_part=self.casing)
        of_bearing = self._component("rolling_bearing_row", where, **of_row)
        self._relation("assembly", assembly=id, part=of_bearing)
        element = self._component("rolling_element", where, **of_element)
        self._relation("assembly", assembly=of_bearing, part=element)
        self._account_for_lost(bearing, where)

    def _account_for_lost(self, bearing: Bearing | RollingBearing, where: str) -> None:
        """What is not written of a bearing beside its stiffness or its geometry."""
        lost = [f"damping_time {bearing.damping_time:g} s"] * (bearing.damping_time > 0)
        lost += [f"{bearing.drag}"] * (bearing.drag is not None)
        if isinstance(bearing, RollingBearing):
            row = bearing.rows[0]
            lost += [f"guidance {bearing.guidance:g} N/m"] * (bearing.guidance > 0)
            lost += ["an outer ring that turns"] * row.on_pin + ["a cage that rolls"] * (row.cage_angle is not None)
            lost += [f"balls of E = {row.E / GPa:g} GPa, nu = {row.nu:g}"] * ((row.E, row.nu) != (Row.E, Row.nu))
        if lost:
            self.account.left_out(where, f"{', '.join(lost)} {'are' if len(lost) > 1 else 'is'} not written")

    def _gear(self, gear: Gear, at: np.ndarray, u: float, where: str, shaft: str) -> str:
        sizes: dict[str, Value] = {
            "number_of_teeth": (abs(gear.z), "none"),
            "normal_module": (gear.m_n, "mm"),
            "helix_angle_reference_diameter": (gear.beta, "deg"),
            "face_width": (gear.b, "mm"),
            "tip_diameter": (abs(gear.d_a), "mm"),
            "root_diameter": (abs(gear.d_f), "mm"),
            "normal_tooth_thickness_at_pitch_diameter": (gear.s_n, "mm"),
            "u_coordinate_on_shaft": (u, "mm"),
        }
        if not gear.internal:
            sizes["inner_diameter"] = gear.d_bore, "mm"
        id = self._component("ring_gear" if gear.internal else "cylindrical_gear", where, **_placed(at), **sizes)
        self._relation("assembly", assembly=shaft, part=id)
        both = (gear.flank.left, gear.flank.right) if isinstance(gear.flank, Sides) else (gear.flank, gear.flank)
        x: dict[str, Value] = {"normal_pressure_angle": (gear.alpha_n, "deg")}
        x["addendum_modification_coefficient"] = gear.x, "none"
        flanks = [self._component("cylindrical_gear_flank", f"{where}, {side}", **x) for side in ("left", "right")]
        self._relation("flank", gear=id, left=flanks[0], right=flanks[1])
        for flank, modifications in zip(flanks, both, strict=True):
            self._modifications(flank, modifications, where)
        if gear.rho_f is not None:
            factor: dict[str, Value] = {"tip_radius_factor": (gear.rho_f / gear.m_n, "none")}
            tool = self._component("rack_shaped_tool", f"rack of {where}", **factor)
            self._relation("reference", origin=id, referenced=tool)
        elif gear.fillet is not None or gear.cutter is not None:
            self.account.left_out(where, "root fillet is not written")
        if gear.internal:
            held = f", held by {', '.join(map(str, gear.support))}," if gear.support else ""
            self.account.left_out(where, f"rim up to a diameter of {abs(gear.d_rim) / mm:g} mm{held} is not written")
        self._relation("reference", origin=id, referenced=self._material(gear))
        return id

    def _material(self, owner: Gear | Shaft) -> str:
        material = owner.material
        values: dict[str, Value] = {"elastic_modulus": (material.E, "N / mm^2"), "poisson_ratio": (material.nu, "none")}
        return self._component("material", "material", **values, density=(material.density, "kg / dm^3"))

    def _modifications(self, flank: str, modifications, where: str) -> None:
        for part in modifications:
            known = _modification(part)
            if known is None:
                self.account.left_out(where, f"{part} is not written")
                continue
            type, values = known
            self._relation("reference", origin=flank, referenced=self._component(type, where, **values))

    def _bearing(self, bearing: Bearing, at: np.ndarray, u: float, where: str, shaft: str) -> None:
        whole = bearing.matrix is None and bearing.table is None
        radial, axial, tilt = bearing.radial, bearing.axial, bearing.tilt
        if bearing.table is not None:
            displacements, forces = bearing.table
            radial += forces[-1] / displacements[-1]
        if bearing.matrix is not None:
            radial, axial, tilt = (float(np.diag(bearing.matrix)[i]) for i in (0, 2, 3))
        if not whole or bearing.clearance:
            words = f"clearance, table or matrix of the bearing is not written: radial {radial:.4g} N/m stands for it"
            self.account.left_out(where, words)
        values: dict[str, Value] = {
            "radial_stiffness": (radial, "N / m"),
            "axial_stiffness": (axial, "N / m"),
            "bending_stiffness": (tilt, "N mm / rad"),
            "axial_force_absorption": ("both_directions" if axial else "no_direction", "none"),
            "radial_force_absorption": (radial > 0, "none"),
            "u_coordinate_on_shaft_inner_side": (u, "mm"),
        }
        id = self._component("concept_bearing", where, **_placed(at), **values)
        self._relation("assembly", assembly=self.unit, part=id)
        self._relation("side", assembly=id, inner_part=shaft, outer_part=self.casing)
        self._account_for_lost(bearing, where)

    def _stage(self, stage: Stage, positions) -> None:
        pair, ends = stage.pair, (stage.fast.name, stage.slow.name)
        (x_1, y_1), (x_2, y_2) = (positions[name] for name in ends)
        angle = atan2(x_2 - x_1, y_2 - y_1)
        values: dict[str, Value] = {
            "center_distance": (abs(pair.a), "mm"),
            "rotating_angle_around_neg_u_axis": (angle, "deg"),
        }
        if np.isfinite(stage.force.backlash):
            j_bn = stage.force.backlash * np.cos(pair.beta_b)
            values |= {f"{end}_normal_backlash": (j_bn, "mm") for end in ("minimum", "maximum")}
        id = self._component("cylindrical_stage", stage.name, **values)
        self._relation("assembly", assembly=self.unit, part=id)
        gears = [self.gears[name, axial] for name, axial in zip(ends, stage.axial_positions, strict=True)]
        self._relation("stage", stage=id, gear_1=gears[0], gear_2=gears[1])
        lost = ["force law", f"damping {stage.force.damping:.4g} N s/m"]
        lost += ["friction"] * (stage.friction is not None)
        lost += [f"phase {stage.phase:g}"] if stage.phase is not None else []
        self.account.left_out(stage.name, f"{', '.join(lost[:-1])} and {lost[-1]} are not written")

    def load_spectrum(self, gearbox: Gearbox, cases: list[LoadCase]) -> None:
        """Speed of the driving shaft, torque on it and the load that balances it."""
        loads = {}
        for end in (gearbox.driving, gearbox.driven):
            marks: dict[str, Value] = {"transmits_torque": (True, "none")}
            if end.sections:
                marks["u_coordinate_on_shaft"] = end.end_position - self.begins[end.name], "mm"
            marks["defines_torque"] = end is gearbox.driving, "none"
            loads[end.name] = self._component("external_load", f"load on {end.name}", **marks)
            self._relation("assembly", assembly=self.shafts[end.name], part=loads[end.name])
        if not cases:
            return
        self.cases = ElementTree.Element("load_spectrum", id="1")
        for number, case in enumerate(cases, start=1):
            element = ElementTree.SubElement(self.cases, "load_case", id=str(number))
            torque = case.load * abs(gearbox.ratios[gearbox.driven.name])
            self._of_case(element, self.unit, load_duration_fraction=(case.share, "%"))
            self._of_case(element, self.shafts[gearbox.driving.name], rotational_speed=(case.speed, "1 / min"))
            self._of_case(element, loads[gearbox.driving.name], torque_around_u_axis=(torque, "N m"))
            further = [name for name, value in case.torques.items() if value and name not in loads]
            lost = [f"torques on {', '.join(further)}"] if further else []
            lost += [f"forces on {', '.join(case.forces)}"] if case.forces else []
            if lost:
                self.account.left_out(case.name, f"{' and '.join(lost)} are not written")

    def _of_case(self, element: ElementTree.Element, id: str, **attributes: Value) -> None:
        given = dict(self.components[int(id) - 1].attrib)
        _add(ElementTree.SubElement(element, "component", given), attributes)


def _placed(at: np.ndarray) -> dict[str, Value]:
    """Position (u, v, w) of a component in the gear unit, its axes along those of the unit."""
    unit = {"u_axis_vector": (mm * np.array([1, 0, 0]), "mm"), "w_axis_vector": (mm * np.array([0, 0, 1]), "mm")}
    return {"support_vector": (at, "mm"), **unit, "reference_component_for_position": ("1", "none")}


def _modification(part) -> tuple[str, dict[str, Value]] | None:
    """Type and values of a flank modification that REXS has, else None."""
    if isinstance(part, TipRelief | RootRelief):
        name, amount, d = ("tip", part.C_a, part.d_Ca) if isinstance(part, TipRelief) else ("root", part.C_f, part.d_Cf)
        depth: dict[str, Value] = {f"{name}_relief_depth": (amount, "mm")}
        linear = d is not None and part.power == 1
        return (f"{name}_relief", depth | {f"{name}_relief_datum_diameter": (d, "mm")}) if linear else None
    if isinstance(part, ProfileCrowning):
        return "profile_crowning", {f"profile_crowning_at_{end}": (part.C_alpha, "mm") for end in ("tip", "root")}
    if isinstance(part, LeadCrowning):
        ends = "datum_face", "non_datum_face"
        return "helix_crowning", {f"helix_crowning_amount_{end}": (part.C_beta, "mm") for end in ends}
    return None


def _add(element: ElementTree.Element, attributes: dict[str, Value]) -> None:
    for id, (value, unit) in attributes.items():
        attribute = ElementTree.SubElement(element, "attribute", id=id, unit=unit)
        if isinstance(value, np.ndarray):
            array = ElementTree.SubElement(attribute, "array")
            for each in value:
                ElementTree.SubElement(array, "c").text = repr(float(each) / UNITS[unit])
        elif isinstance(value, bool | np.bool_):
            attribute.text = str(bool(value)).lower()
        elif isinstance(value, str):
            attribute.text = value
        else:
            attribute.text = repr(float(value) / UNITS[unit])  # type: ignore[arg-type]
