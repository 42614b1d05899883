"""Small REXS files of the structure that other programs write, in XML, JSON and zip."""

import json
import zipfile
from pathlib import Path
from xml.etree import ElementTree

Attributes = dict[str, tuple]
DEG = {"1.0": "°", "1.1": "°", "1.4": "deg", "2.0": "deg"}
FLANK = {"1.0": "flank_geometry", "1.1": "flank_geometry"}
NONE = {"1.0": "none", "1.1": "none", "1.4": ""}


class RexsData:
    """Components, relations and load cases of a file that is written in any container."""

    def __init__(self, version: str = "1.4", **model):
        self.version, self.model = version, {"applicationId": "a program", "applicationVersion": "1"} | model
        self.components: list[dict] = []
        self.relations: list[dict] = []
        self.load_cases: list[list[dict]] = []

    def add(self, type: str, name: str = "", **attributes) -> int:
        """A component with attributes (value, unit); its number."""
        self.components.append(
            {"id": len(self.components) + 1, "type": type, "name": name, "attributes": dict(attributes)}
        )
        return len(self.components)

    def relate(self, type: str, **roles: int) -> None:
        self.relations.append({"type": type, "roles": roles})

    def load_case(self, **attributes_by_id) -> None:
        """Attributes by "_<id>" of components that change in a load case."""
        case = [dict(self.components[int(id[1:]) - 1]) | {"attributes": x} for id, x in attributes_by_id.items()]
        self.load_cases.append(case)

    def xml(self) -> str:
        head = self.model | {"version": self.version}
        root = ElementTree.Element("model", {key: str(value) for key, value in head.items()})
        relations = ElementTree.SubElement(root, "relations")
        for number, relation in enumerate(self.relations, start=1):
            element = ElementTree.SubElement(relations, "relation", id=str(number), type=relation["type"])
            for role, id in relation["roles"].items():
                ElementTree.SubElement(element, "ref", id=str(id), role=role, hint=self.components[id - 1]["type"])
        _write_components(ElementTree.SubElement(root, "components"), self.components)
        if self.load_cases:
            spectrum = ElementTree.SubElement(root, "load_spectrum", id="1")
            for number, case in enumerate(self.load_cases, start=1):
                _write_components(ElementTree.SubElement(spectrum, "load_case", id=str(number)), case)
        ElementTree.indent(root)
        return '<?xml version="1.0" encoding="UTF-8"?>\n' + ElementTree.tostring(root, encoding="unicode")

    def json(self) -> str:
        model = self.model | {"version": self.version, "components": [_json(x) for x in self.components]}
        model["relations"] = [
            {
                "id": number,
                "type": relation["type"],
                "refs": [{"id": id, "role": role, "hint": ""} for role, id in relation["roles"].items()],
            }
            for number, relation in enumerate(self.relations, start=1)
        ]
        cases = [{"id": n, "components": [_json(x) for x in case]} for n, case in enumerate(self.load_cases, start=1)]
        spectrum = {"load_spectrum": {"id": 1, "load_cases": cases}} if cases else {}
        return json.dumps({"model": model | spectrum}, indent=1)

    def write(self, path: Path) -> Path:
        """The file in the container that its suffix names."""
        if path.suffix == ".rexsz":
            with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
                archive.writestr("model.rexs", self.xml())
        else:
            path.write_text(self.json() if path.suffix == ".rexsj" else self.xml(), encoding="utf-8")
        return path


def _write_components(parent: ElementTree.Element, components: list[dict]) -> None:
    for component in components:
        element = ElementTree.SubElement(
            parent, "component", id=str(component["id"]), type=component["type"], name=component["name"]
        )
        for id, (value, unit) in component["attributes"].items():
            attribute = ElementTree.SubElement(element, "attribute", id=id, unit=unit)
            if isinstance(value, tuple | list):
                array = ElementTree.SubElement(attribute, "array")
                for each in value:
                    ElementTree.SubElement(array, "c").text = str(each).lower()
            else:
                attribute.text = str(value).lower() if isinstance(value, bool) else str(value)


def _json(component: dict) -> dict:
    attributes = []
    for id, (value, unit) in component["attributes"].items():
        many = isinstance(value, tuple | list)
        first = value[0] if many else value
        kind = "boolean" if isinstance(first, bool) else "string" if isinstance(first, str) else "floating_point"
        key, given = (f"{kind}_array", list(value)) if many else (kind, value)
        attributes.append({"id": id, "unit": unit, key: given})
    return component | {"attributes": attributes}


def _placed(*at: float) -> Attributes:
    return {"support_vector": (at, "mm"), "u_axis_vector": ((1.0, 0.0, 0.0), "mm")}


def two_stages(version: str = "1.4", **changes) -> RexsData:
    """Three shafts with two helical stages at right angles, ball bearings by catalogue and a rigid one, two loads.

    coaxial   positions on the fast shaft [mm] of bearings that carry the slow one, which then lies on its axis
    """
    coaxial = changes.pop("coaxial", ())
    data, none, deg = RexsData(version), NONE.get(version, ""), DEG[version]
    unit, casing = data.add("gear_unit", "unit"), data.add("gear_casing", "housing")
    data.relate("assembly", assembly=unit, part=casing)
    data.add("lubricant", "oil", viscosity_at_40_degree_celsius=(100.0, "mm^2 / s"))

    def shaft(name: str, at: tuple, length: float, **attributes) -> int:
        id = data.add("shaft", name, **_placed(*at), **attributes)
        data.relate("assembly", assembly=unit, part=id)
        ends = {
            f"{side}_diameter_{end}": (d, "mm")
            for side, d in (("outer", 30.0), ("inner", 0.0))
            for end in ("begin", "end")
        }
        section = data.add("shaft_section", "", u_coordinate_on_shaft=(0.0, "mm"), length=(length, "mm"), **ends)
        data.relate("assembly", assembly=id, part=section)
        return id

    def gear(on: int, at: tuple, z: int, m_n: float, beta: float, x: float, b: float, u: float, **more) -> int:
        sizes = {"number_of_teeth": (float(z), none), "normal_module": (m_n, "mm"), "face_width": (b, "mm")}
        sizes |= {"helix_angle_reference_diameter": (beta, deg), **_placed(*at)}
        face = u - b / 2 if version == "1.0" else u
        id = data.add("cylindrical_gear", f"gear {z}", u_coordinate_on_shaft=(face, "mm"), **sizes, **more)
        data.relate("assembly", assembly=on, part=id)
        angle = {"normal_pressure_angle": (20.0, deg), "addendum_modification_coefficient": (x, none)}
        flanks = [data.add(FLANK.get(version, "cylindrical_gear_flank"), "", **angle) for _ in range(2)]
        data.relate("flank", gear=id, left=flanks[0], right=flanks[1])
        return id

    def bearing(on: int, u: float, type: str = "rolling_bearing_with_catalog_geometry", **attributes) -> None:
        id = data.add(type, f"bearing {u}", u_coordinate_on_shaft_inner_side=(u, "mm"), **attributes)
        data.relate("side", assembly=id, inner_part=on, outer_part=casing)

    def stage(first: int, second: int, a: float, angle: float) -> None:
        sizes = {"center_distance": (a, "mm"), "rotating_angle_around_neg_u_axis": (angle, deg)}
        id = data.add("cylindrical_stage", "stage", **sizes)
        data.relate("assembly", assembly=unit, part=id)
        data.relate("stage", stage=id, gear_1=first, gear_2=second)

    ball = {"bearing_type": ("radial_grooved_ball_bearing", none), "inner_diameter": (30.0, "mm")}
    ball |= {"outer_diameter": (72.0, "mm"), "dynamic_capacity": (29.0, "kN")}
    one_way = {"axial_force_absorption": ("no_direction", none)}
    fast = shaft("fast", (0.0, 0.0, 0.0), 100.0, rotational_speed=(1500.0, "1 / min"), defines_speed=(True, none))
    middle = shaft("middle", (0.0, 75.0, 0.0), 100.0)
    slow = shaft("slow", (50.0, 0.0, 0.0) if coaxial else (0.0, 75.0, 100.0), 100.0)
    gears = [
        gear(fast, (30.0, 0.0, 0.0), 25, 2.0, 15.0, changes.pop("x", 0.0), 20.0, 30.0),
        gear(middle, (30.0, 75.0, 0.0), 47, 2.0, -15.0, 0.0, 20.0, 30.0),
        gear(middle, (70.0, 75.0, 0.0), 24, 2.5, -8.0, 0.0, 25.0, 70.0, tip_diameter=(1.0, "mm")),
        gear(slow, (70.0, 75.0, 100.0), 55, 2.5, 8.0, 0.0, 25.0, 70.0),
    ][: 2 if coaxial else 4]
    if coaxial:
        gears.append(gear(middle, (75.0, 75.0, 0.0), 47, 2.0, -15.0, 0.0, 20.0, 75.0))
        gears.append(gear(slow, (75.0, 0.0, 0.0), 25, 2.0, 15.0, changes.pop("x_slow", 0.0), 20.0, 25.0))
    for u in coaxial:
        sides = {"u_coordinate_on_shaft_inner_side": (u, "mm"), "u_coordinate_on_shaft_outer_side": (u - 50.0, "mm")}
        between = data.add("rolling_bearing_with_catalog_geometry", f"pilot {u}", **sides, **ball)
        data.relate("side", assembly=between, inner_part=fast, outer_part=slow)
    for on in (fast, middle) if coaxial else (fast, middle, slow):
        bearing(on, 10.0, **ball)
        bearing(on, 90.0, **ball, **one_way)
    stage(gears[0], gears[1], 75.0, 90.0)
    stage(gears[2], gears[3], *((75.0, -90.0) if coaxial else (100.0, 0.0)))
    loads = [data.add("external_load", f"load {on}", transmits_torque=(True, none)) for on in (fast, slow)]
    for on, load in zip((fast, slow), loads, strict=True):
        data.relate("assembly", assembly=on, part=load)
    data.components[loads[0] - 1]["attributes"]["torque_around_u_axis"] = (40.0, "N m")
    data.ids = {"unit": unit, "fast": fast, "slow": slow, "gears": gears, "load": loads[0], "casing": casing}
    return data


def planetary(
    version: str = "1.1",
    *,
    stepped: bool = False,
    pin: float = 0.0,
    on_bearings: bool = False,
    rollers: Attributes | None = None,
) -> RexsData:
    """A set of 17/22/61 teeth with three planets, its ring held by an engaged coupling.

    stepped       whether the planets have a second gear, of 19 teeth, at a ring of 58
    pin           radial stiffness [N/m] of each of two bearings of a planet on its pin; 0 for none
    on_bearings   whether sun and carrier have a bearing at each end
    rollers       of each of two rolling bearings of a planet on its pin instead, by catalogue
    """
    data, none, deg = RexsData(version), NONE.get(version, ""), DEG[version]
    unit, casing = data.add("gear_unit", "unit"), data.add("gear_casing", "housing")
    set_id, carrier = data.add("planetary_stage", "set"), data.add("planet_carrier", "carrier")
    data.relate("assembly", assembly=set_id, part=carrier)

    def shaft(name: str, at: tuple, role: str, **attributes) -> int:
        id = data.add("shaft", name, **_placed(*at), **attributes)
        data.relate(role, planetary_stage=set_id, shaft=id)
        return id

    def gear(on: int, at: tuple, z: float, type: str = "cylindrical_gear") -> int:
        sizes = {"number_of_teeth": (z, none), "normal_module": (4.0, "mm"), "face_width": (50.0, "mm")}
        id = data.add(type, f"gear {z}", u_coordinate_on_shaft=(at[0] - 100.0, "mm"), **sizes, **_placed(*at))
        data.relate("assembly", assembly=on, part=id)
        return id

    speed = {"rotational_speed": (1500.0, "1 / min"), "defines_speed": (True, none)}
    sun = shaft("sun shaft", (100.0, 0.0, 0.0), "central_shaft", **speed)
    ring, arm = (
        shaft(name, (100.0, 0.0, 0.0), role)
        for name, role in (("ring shaft", "central_shaft"), ("carrier shaft", "planet_carrier_shaft"))
    )
    sun_gear = gear(sun, (125.0, 0.0, 0.0), 17.0)
    at_ring, teeth = (185.0, (58.0, 19.0)) if stepped else (125.0, (61.0, 22.0))
    ring_gear = gear(ring, (at_ring, 0.0, 0.0), teeth[0], "ring_gear")
    planets = ((0.0, 78.0), (67.54998149518622, -39.0), (-67.54998149518622, -39.0))
    for number, (v, w) in enumerate(planets):
        own = shaft(f"planet shaft @ {number}", (100.0, v, w), "planet_shaft")
        planet_gear = gear(own, (125.0, v, w), 22.0)
        second_gear = gear(own, (at_ring, v, w), teeth[1]) if stepped else planet_gear
        for u in (10.0, at_ring - 85.0) if pin or rollers else ():
            stiffness = {"radial_stiffness": (pin, "N / m"), "axial_stiffness": (pin / 10, "N / m")}
            type = "rolling_bearing_with_catalog_geometry" if rollers else "concept_bearing"
            sizes = rollers or stiffness
            bearing = data.add(type, f"pin {u}", u_coordinate_on_shaft_outer_side=(u, "mm"), **sizes)
            data.relate("side", assembly=bearing, outer_part=own, inner_part=arm)
        angle = {"center_distance": (78.0, "mm"), "rotating_angle_around_neg_u_axis": (120.0 * number, deg)}
        for first, second in ((sun_gear, planet_gear), (second_gear, ring_gear)):
            stage = data.add("cylindrical_stage", "mesh", **angle)
            data.relate("assembly", assembly=set_id, part=stage)
            data.relate("stage", stage=stage, gear_1=first, gear_2=second)
            angle = angle | {"rotating_angle_around_neg_u_axis": (120.0 * number + 180.0, deg)}
    for on in (sun, arm) if on_bearings else ():
        for u in (0.0, 150.0):
            stiffness = {"radial_stiffness": (3e8, "N / m"), "axial_stiffness": (1e8, "N / m")}
            bearing = data.add("concept_bearing", f"at {u}", u_coordinate_on_shaft_inner_side=(u, "mm"), **stiffness)
            data.relate("side", assembly=bearing, inner_part=on, outer_part=casing)
    coupling = data.add("switchable_coupling", "coupling", is_engaged=((True,), none))
    data.relate("side", assembly=coupling, inner_part=ring, outer_part=casing)
    for on, torque in ((sun, {"torque_around_u_axis": (1591.55, "N m")}), (arm, {})):
        load = data.add("external_load", "load", transmits_torque=(True, none), **torque)
        data.relate("assembly", assembly=on, part=load)
    data.relate("assembly", assembly=unit, part=set_id)
    return data
