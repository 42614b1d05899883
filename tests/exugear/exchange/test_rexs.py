"""REXS files: what is read in each container and version, what is told, and what is refused."""

import base64
import re
import zipfile

import numpy as np
import pytest
from rexs_files import RexsData, planetary, two_stages

import exugear
import fem
from fem.units import deg, mm, rpm

QUICK = {"mesh": "iso6336", "shafts": "rigid", "bearings": "linear", "progress": False}


def read(data: RexsData, folder, suffix: str = ".rexs", **options):
    return exugear.read_rexs(data.write(folder / f"model{suffix}"), **QUICK | options)


def told(model, kind: str, words: str) -> list:
    """Rows of the account of a kind that hold the words."""
    return [row for row in model.account.rows if row.kind == kind and words in f"{row.part} {row.text}"]


@pytest.mark.parametrize("version", ["1.0", "1.4", "2.0"])
@pytest.mark.parametrize("suffix", [".rexs", ".rexsj", ".rexsz"])
def test_every_container_and_version_holds_the_same_gearbox(version, suffix, tmp_path):
    """Ratios, mesh frequencies and positions; u, v, w become z, x, y."""
    model = read(two_stages(version), tmp_path, suffix)
    box, (case,) = model
    assert box.ratios == pytest.approx({"fast": 1, "middle": -25 / 47, "slow": 25 / 47 * 24 / 55})
    assert (box.driving.name, box.driven.name) == ("fast", "slow")
    assert box.shaft_positions["slow"] == pytest.approx((75 * mm, 100 * mm))
    assert [stage.angle for stage in box.stages] == pytest.approx([0, np.pi / 2])
    assert [stage.axial_positions[0] for stage in box.stages] == pytest.approx([30 * mm, 70 * mm])
    assert case.speed == pytest.approx(1500 * rpm)
    assert case.load == pytest.approx(40 * 47 / 25 * 55 / 24)
    assert [stage.pair.pinion.beta for stage in box.stages] == pytest.approx([15 * deg, -8 * deg])


def test_static_forces_and_a_run_have_the_torques_of_the_file(tmp_path):
    model = read(two_stages(), tmp_path)
    box, case = model.gearbox, model.load_cases[0]
    assert box.static_forces(case.load)[0] == pytest.approx(40 / box.stages[0].pair.pinion.r_b)
    data = exugear.run_up(
        exugear.build(box), speed=(case.speed, case.speed), load=case.load, duration=2e-3, progress=False, checks=0
    ).data
    assert data["drive_torque"].values[-1] == pytest.approx(40, rel=1e-6)
    assert data["mesh_frequency"].values[:, -1] == pytest.approx([625, 625 / 47 * 24])
    assert float(np.abs(data["bearing_force"]).max()) > 100


def test_maps_reach_as_far_as_the_load_cases(tmp_path):
    asked = []

    def law(pair, torque):
        asked.append(torque)
        return fem.ste_map(
            pair, [0, torque, 2 * torque], np.arange(4) / 4, torque / 2e10 * np.outer([0, 1, 2], np.ones(4))
        )

    exugear.read_rexs(two_stages().write(tmp_path / "model.rexs"), mesh=law)
    assert asked == pytest.approx([40, 40 * 47 / 25])


def test_a_law_that_takes_offsets_gets_the_distance_of_the_mid_planes(tmp_path):
    """The wheel of the first stage stands 2 mm from its pinion; in the second stage there is none to count."""
    data, asked = two_stages(), []
    wheel = next(component for component in data.components if component["name"] == "gear 47")
    wheel["attributes"] |= {"u_coordinate_on_shaft": (32.0, "mm"), "support_vector": ((32.0, 75.0, 0.0), "mm")}

    def law(pair, torque, offsets=None):
        asked.append(0.0 if offsets is None else offsets.axial)
        te = torque / 2e10 * np.outer([0, 1, 2], np.ones(4))
        return fem.ste_map(pair, [0, torque, 2 * torque], np.arange(4) / 4, te).assign_attrs(axial=asked[-1])

    box = read(data, tmp_path, mesh=law).gearbox
    assert asked == pytest.approx([2 * mm, 0.0])
    assert exugear.plan(box).laws.keys() == set(box.labels)


def test_load_cases_of_a_spectrum(tmp_path):
    data = two_stages()
    unit, fast, load = (f"_{data.ids[name]}" for name in ("unit", "fast", "load"))
    for share, speed, torque in ((20.0, 600.0, 50.0), (80.0, 3000.0, -10.0)):
        case = {unit: {"load_duration_fraction": (share, "%")}, fast: {"rotational_speed": (speed, "1 / min")}}
        data.load_case(**case, **{load: {"torque_around_u_axis": (torque, "N m")}})
    cases = read(data, tmp_path).load_cases
    gear = 47 / 25 * 55 / 24
    assert [case.share for case in cases] == pytest.approx([0.2, 0.8])
    assert [case.speed / rpm for case in cases] == pytest.approx([600, 3000])
    assert [case.load for case in cases] == pytest.approx([50 * gear, -10 * gear])


@pytest.mark.parametrize("suffix", [".rexs", ".rexsj"])
def test_a_planetary_stage_is_a_set(suffix, tmp_path):
    """A ring of 61 teeth has z = -61; the engaged coupling holds it; its tip is shortened to clear the planets."""
    model = read(planetary(), tmp_path, suffix)
    box, (case,) = model
    assert box.held == ("ring shaft",)
    assert box.ratios["carrier shaft"] == pytest.approx(17 / 78)
    assert box.stages[1].pair.wheel.z == -61
    assert case.load == pytest.approx(1591.55 * 78 / 17)
    assert box.static_forces(case.load) == pytest.approx([1591.55 / 3 / box.stages[0].pair.pinion.r_b] * 6, rel=1e-6)
    assert told(model, "assumed", "tip shortened")
    assert exugear.plan(box).laws.keys() == set(box.labels)  # the set does not stand at the axial position 0


def test_stepped_planets_mesh_with_sun_and_ring_by_either_gear(tmp_path):
    """Ratio by Willis: 1 - (-22/17 * 58/19); the file does not tell the angle between both gears."""
    model = read(planetary(stepped=True), tmp_path)
    (planets,) = model.gearbox.sets
    assert planets.stepped
    assert 1 / model.gearbox.ratios["carrier shaft"] == pytest.approx(1 + 22 / 17 * 58 / 19)
    assert sorted(planets.planet_shafts[0].gears) == pytest.approx([125 * mm, 185 * mm])
    assert told(model, "assumed", "stands 0 deg ahead of one at the sun")


def test_members_of_sets_stand_on_their_bearings_where_pins_are_elastic(tmp_path):
    """Stiffness of both bearings of a pin, about the planet's gear; without elastic pins members only spin."""
    rigid, elastic = (read(planetary(pin=x, on_bearings=True), tmp_path) for x in (0.0, 2e8))
    assert not any(shaft.bearings for shaft in rigid.gearbox.shafts)
    assert told(rigid, "assumed", "ideal bearings, as the planets of its set turn on ideal pins")
    shafts = {shaft.name: shaft for shaft in elastic.gearbox.shafts}
    assert len(shafts["sun shaft"].bearings) == len(shafts["carrier shaft"].bearings) == 2
    (pin,) = shafts["planet shaft @ 0"].bearings.values()
    assert (pin.radial, pin.axial, pin.tilt) == pytest.approx((4e8, 4e7, 2 * 2e8 * (15 * mm) ** 2))
    case = elastic.load_cases[0]
    forces = elastic.gearbox.static_forces(case.load)
    assert forces == pytest.approx([forces[0]] * 6)


NEEDLES = {
    "bearing_type": ("cylindrical_roller_bearing", "none"),
    "inner_diameter": (20.0, "mm"),
    "outer_diameter": (47.0, "mm"),
    "width": (14.0, "mm"),
    "dynamic_capacity": (28.5, "kN"),
    "static_capacity": (24.7, "kN"),
}


def test_rolling_bearings_of_planets_keep_their_law(tmp_path):
    """Both bearings of a pin are rows of one, on either side of the gear; washers along the pin are assumed."""
    rolling = read(planetary(rollers=NEEDLES), tmp_path, bearings="rolling")
    shafts = {shaft.name: shaft for shaft in rolling.gearbox.shafts}
    (pin,) = shafts["planet shaft @ 0"].bearings.values()
    assert isinstance(pin, exugear.RollingBearing)
    assert [row.axial for row in pin.rows] == pytest.approx([-15 * mm, 15 * mm])
    assert pin.C == 28.5e3
    assert told(rolling, "assumed", "cylindrical roller bearing by its force law")
    assert told(rolling, "assumed", "washers hold the planet along its pin with 1e+07 N/m")
    faces = exugear.load_distribution(rolling.gearbox, 500.0, mesh_stiffness=15e9)
    forces = np.linalg.norm(faces["bearing_force"].values, axis=1)
    assert forces == pytest.approx(500.0 / (3 * 78 * mm), rel=0.02)
    linear = read(planetary(rollers=NEEDLES), tmp_path)
    (pin,) = next(x for x in linear.gearbox.shafts if x.name == "planet shaft @ 0").bearings.values()
    assert isinstance(pin, exugear.Bearing)
    assert told(linear, "assumed", "linear under 2850 N")
    assert pin.axial == 1e7


def test_the_angle_of_stepped_planets_is_an_argument(tmp_path):
    """The least angle by which sets with it can be assembled: they fit again one pitch of either gear further."""
    model = read(planetary(stepped=True), tmp_path, step_angle=2 * np.pi / 22)
    assert model.gearbox.sets[0].step_angle == pytest.approx([2 * np.pi / 22] * 3)
    assert told(model, "assumed", "stands 16.3636 deg ahead of one at the sun, step_angle=")


def test_positions_follow_from_the_stages_where_they_are_lost(tmp_path):
    """Public JSON files have `false` instead of arrays."""
    whole = read(planetary(), tmp_path)
    data = planetary()
    for component in data.components:
        for name in component["attributes"].keys() & {"support_vector", "u_axis_vector", "is_engaged"}:
            component["attributes"][name] = False, component["attributes"][name][1]
    box = read(data, tmp_path, ".rexsj").gearbox
    assert box.held == ("ring shaft",)
    for name, position in whole.gearbox.shaft_positions.items():
        assert box.shaft_positions[name] == pytest.approx(position, abs=1e-9)


def test_nothing_is_lost_in_silence(tmp_path):
    """What is not modelled, placeholders, assumptions, each with its component; XML tells the line."""
    data = two_stages()
    data.components[data.ids["gears"][0] - 1]["attributes"]["flank_roughness_unknown_to_us"] = 3.0, "mum"
    data.relate("side", assembly=data.add("worm_stage", "worm"), inner_part=1)
    model = read(data, tmp_path)
    assert told(model, "left out", "flank_roughness_unknown_to_us")
    assert told(model, "left out", "lubricant") and told(model, "left out", "worm")
    assert told(model, "left out", "tip_diameter 1 mm is a placeholder")
    assert told(model, "assumed", "deep groove bearing, linear under 2900 N")
    assert told(model, "assumed", "damping ratio") and told(model, "assumed", "steel")
    assert all("line" in row.part for row in told(model, "read", "cylindrical_gear"))


def test_loads_of_every_case_are_told_or_read(tmp_path):
    """Attributes of a later load case alone are told, and two loads with powers on a shaft act together."""
    data = two_stages()
    load, shaft = (f"_{data.ids[name]}" for name in ("load", "fast"))
    data.load_case(**{load: {"power": (2.0, "kW")}, shaft: {"rotational_speed": (600.0, "1 / min")}})
    data.load_case(**{load: {"power": (2.0, "kW")}, "_1": {"temperature_lubricant": (60.0, "C")}})
    data.components[data.ids["load"] - 1]["attributes"].pop("torque_around_u_axis", None)
    one = read(data, tmp_path)
    assert told(one, "left out", "temperature_lubricant")
    second = data.add("external_load", "", power=(1.0, "kW"))
    data.relate("assembly", assembly=data.ids["fast"], part=second)
    both = read(data, tmp_path)
    assert both.load_cases[0].load == pytest.approx(1.5 * one.load_cases[0].load)


@pytest.mark.parametrize("suffix", [".rexs", ".rexsj"])
def test_results_over_all_load_cases_are_left_out_in_words(suffix, tmp_path):
    """As REXSapi writes them: components of the model once more, behind the load cases."""
    data = two_stages()
    data.load_case(_1={"load_duration_fraction": (50.0, "%")})
    path = data.write(tmp_path / f"model{suffix}")
    text = path.read_text()
    if suffix == ".rexs":
        result = '<component id="1" type="gear_unit"><attribute id="load_duration_fraction" unit="%">7</attribute>'
        text = text.replace("</load_case>", f"</load_case><accumulation>{result}</component></accumulation>")
    else:
        text = text.replace('"load_cases"', '"accumulation": {"components": [{"id": 1}]}, "load_cases"')
    path.write_text(text)
    model = exugear.read_rexs(path, **QUICK)
    assert told(model, "left out", "accumulation of the load cases")
    assert [case.share for case in model.load_cases] == [pytest.approx(0.5)]


@pytest.mark.parametrize(("suffix", "type"), [(".rexs", r' type="[a-z_]*"'), (".rexsj", r'"type": "[a-z_]*",? ?')])
def test_components_of_load_cases_may_leave_their_type_to_the_model(suffix, type, tmp_path):
    """As REXSapi writes them: the speed of the load case is that of its shaft."""
    data = two_stages()
    data.load_case(**{f"_{data.ids['fast']}": {"rotational_speed": (600.0, "1 / min")}})
    path = data.write(tmp_path / f"model{suffix}")
    model, cases = re.split(r"(?=<load_case |\"load_cases\")", path.read_text(), maxsplit=1)
    untyped = re.sub(type, "", cases)
    assert untyped != cases
    path.write_text(model + untyped)
    assert exugear.read_rexs(path, **QUICK).load_cases[0].speed == pytest.approx(600 * rpm)


def test_elements_that_rexs_has_not_are_told(tmp_path):
    path = two_stages().write(tmp_path / "model.rexs")
    path.write_text(path.read_text().replace("<components>", '<include href="/etc/hostname"/><components>'))
    assert told(exugear.read_rexs(path, **QUICK), "left out", "elements <include>")
    many = "".join(f"<a{i}/>" for i in range(30))
    path.write_text(path.read_text().replace("<components>", f"{many}<components>"))
    with pytest.raises(ValueError, match=r"line \d+ of .*: <a\d+> is no element of REXS"):
        exugear.read_rexs(path, **QUICK)


def test_an_archive_of_macos_holds_its_model(tmp_path):
    with zipfile.ZipFile(tmp_path / "model.rexsz", "w") as file:
        file.writestr("model.rexs", two_stages().xml())
        file.writestr("__MACOSX/._model.rexs", b"\x00\x05\x16\x07")
    assert len(exugear.read_rexs(tmp_path / "model.rexsz", **QUICK).gearbox.stages) == 2


def test_a_file_of_worm_gears_is_told_and_has_no_gearbox(tmp_path):
    data = RexsData()
    data.add("worm_stage", "worm stage")
    model = read(data, tmp_path)
    assert model.gearbox is None and model.load_cases == []
    assert "no cylindrical gears" in str(model) and told(model, "left out", "worm stage")


def test_modifications_of_either_flank(tmp_path):
    data = two_stages()
    left, right = data.ids["gears"][0] + 1, data.ids["gears"][0] + 2
    crowning = {f"helix_crowning_amount_{end}": (0.005, "mm") for end in ("datum_face", "non_datum_face")}
    relief = {"tip_relief_depth": (20.0, "mum"), "tip_relief_datum_diameter": (54.0, "mm")}
    for flank, kind, values in ((left, "helix_crowning", crowning), (right, "tip_relief", relief)):
        data.relate("reference", origin=flank, referenced=data.add(kind, kind, **values))
    model = read(data, tmp_path)
    flank = model.gearbox.stages[0].pair.pinion.flank
    designed = [repr(fem.LeadCrowning(5e-6)), repr(fem.TipRelief(20e-6, d_Ca=54 * mm))]
    assert [repr(part) for part in (*flank.left, *flank.right)] == designed
    assert told(model, "assumed", "left and right flanks as seen from the end to which its u axis points")
    # Seen from behind the left flank is the right one.
    data.components[data.ids["gears"][0] - 1]["attributes"]["u_axis_vector"] = ((-1.0, 0.0, 0.0), "mm")
    flank = read(data, tmp_path).gearbox.stages[0].pair.pinion.flank
    assert [repr(part) for part in (*flank.right, *flank.left)] == designed


def test_arrays_in_base_64(tmp_path):
    data = two_stages()
    path, plain = data.write(tmp_path / "model.rexs"), read(two_stages(), tmp_path).gearbox
    coded = base64.b64encode(np.array([0.0, 75.0, 100.0], "<f8").tobytes()).decode()
    array = "<array>\n          <c>0.0</c>\n          <c>75.0</c>\n          <c>100.0</c>\n        </array>"
    assert array in path.read_text()
    path.write_text(path.read_text().replace(array, f'<array code="float64">{coded}</array>'))
    assert exugear.read_rexs(path, **QUICK).gearbox.shaft_positions == plain.shaft_positions


def changed(old: str, new: str, suffix: str = ".rexs"):
    """Writes the file with a change of its text."""

    def write(folder):
        path = two_stages().write(folder / f"model{suffix}")
        assert old in path.read_text()
        path.write_text(path.read_text().replace(old, new, 1))
        return path

    return write


def archive(*names: str):
    def write(folder):
        with zipfile.ZipFile(folder / "model.rexsz", "w") as file:
            for name in names:
                file.writestr(name, two_stages().xml())
        return folder / "model.rexsz"

    return write


ENTITY = (
    '<?xml version="1.0"?><!DOCTYPE model [<!ENTITY a SYSTEM "file:///etc/hostname">]><model version="1.4">&a;</model>'
)


@pytest.mark.parametrize(
    ("write", "words"),
    [
        (changed('version="1.4"', 'version="3.1"'), "has version '3.1'; versions 1.0 to 1.7 and 2.0 are read"),
        (changed("</components>", ""), r"line \d+ of .* is no XML"),
        (changed('"model"', '"rexs"', ".rexsj"), "no 'model', so it is no REXS file"),
        (changed("{", "{,", ".rexsj"), "line 1 of .* is no JSON"),
        (changed('"id": 4,', '"id": 3,', ".rexsj"), r"line \d+ of .*: a second component has the id 3"),
        (changed('"refs": [', '"refs": [{"id": 99, "role": "x"},', ".rexsj"), r"line \d+ of .*: .* names component 99"),
        (changed('"unit": "mm"', '"unit": "inch"', ".rexsj"), r"\(line \d+\) has the unit 'inch'.* export it in one"),
        (
            changed('unit="mm">20.0', 'unit="inch">20.0'),
            r"face_width .*\(line \d+\) has the unit 'inch'.* export it in one",
        ),
        (changed('unit="mm">20.0', 'unit="mm">wide'), r"face_width .* must be a number, got 'wide'"),
        (changed('unit="mm">75.0', 'unit="mm">85.0'), "center_distance .* is 85 mm, but its shafts lie 75 mm apart"),
        (changed('<component id="4"', '<component id="3"'), r"line \d+ of .*: a second component has the id 3"),
        (changed('<ref id="4"', '<ref id="99"'), "names component 99 as part, which is not there"),
        (archive("a.rexs", "b.rexs"), "a REXS archive holds one model"),
        (archive("readme.txt"), "a REXS archive holds one model"),
        (changed('type="assembly"', 'type="assembly" order="one"'), r"line \d+ of .*: the order of a relation must be"),
        (changed('encoding="UTF-8"', 'encoding="EBCDIC-XX"'), "unknown encoding.* save it in UTF-8"),
        (lambda folder: _text(folder, "<model/>", "utf-16"), "coded in UTF-16; .* save it so"),
        (lambda folder: _text(folder, "gearbox"), "neither XML nor JSON"),
        (lambda folder: _text(folder, ENTITY), "declares a document type or entities"),
        (lambda folder: _text(folder, "<html></html>"), "the root of a REXS file is <model>"),
        (lambda folder: _text(folder, "PK\x03\x04 broken"), "broken or encrypted zip archive"),
    ],
)
def test_broken_files_are_refused_with_the_remedy(write, words, tmp_path):
    with pytest.raises(ValueError, match=words):
        exugear.read_rexs(write(tmp_path), **QUICK)


def _text(folder, text: str, encoding: str = "utf-8"):
    (folder / "model.rexs").write_text(text, encoding)
    return folder / "model.rexs"


@pytest.mark.parametrize(
    ("type", "attribute", "value", "words"),
    [
        (
            "cylindrical_gear",
            "normal_module",
            (-2.0, "mm"),
            r"cylindrical_gear \d+ 'gear 25', line \d+ of .*: m_n must lie",
        ),
        (
            "rolling_bearing_with_catalog_geometry",
            "outer_diameter",
            (20.0, "mm"),
            r"'bearing 10.0', line \d+ of .*: d and D",
        ),
        ("cylindrical_stage", "rotating_angle_around_neg_u_axis", (1.0, "mm"), r"stage.*line \d+.*has the unit 'mm'"),
    ],
)
@pytest.mark.parametrize("suffix", [".rexs", ".rexsj"])
def test_what_a_value_breaks_is_told_with_its_line(type, attribute, value, words, suffix, tmp_path):
    """The line is that where the component begins, or its attribute."""
    data = two_stages()
    component = next(x for x in data.components if x["type"] == type)
    component["attributes"][attribute] = value
    with pytest.raises(ValueError, match=words) as refusal:
        read(data, tmp_path, suffix, bearings="rolling")
    lines = (tmp_path / f"model{suffix}").read_text().splitlines()
    told = int(re.search(r"line (\d+)", str(refusal.value))[1])
    beginning = " ".join(lines[told - 1 : told + 3])
    assert attribute in beginning or f'"{component["id"]}"' in beginning or f'"id": {component["id"]},' in beginning


def test_what_is_written_is_read_again(tmp_path):
    """Pairs, positions, bearings, inertia, backlash and load cases; what is not written is told."""
    model = read(two_stages(), tmp_path)
    account = exugear.write_rexs(tmp_path / "written.rexs", model.gearbox, model.load_cases)
    again = exugear.read_rexs(tmp_path / "written.rexs", **QUICK)
    for before, after in zip(model.gearbox.stages, again.gearbox.stages, strict=True):
        assert repr(after.pair.pinion) == repr(before.pair.pinion) and repr(after.pair.wheel) == repr(before.pair.wheel)
        assert (after.pair.a, after.angle) == pytest.approx((before.pair.a, before.angle))
        assert after.force.backlash == pytest.approx(before.force.backlash)
    for before, after in zip(model.gearbox.shafts, again.gearbox.shafts, strict=True):
        assert (after.inertia, after.mass) == pytest.approx((before.inertia, before.mass))
        assert list(after.bearings.values()) == list(before.bearings.values())
    assert again.load_cases[0].load == pytest.approx(model.load_cases[0].load)
    assert all("not written" in row.text for row in account.rows) and account.rows
    assert sorted(path.name for path in tmp_path.glob("*")) == ["model.rexs", "written.rexs"]


def test_a_floating_bearing_is_written_as_stiff_as_at_the_end_of_its_table(tmp_path):
    """Files that are written can be read: REXS holds no table of forces, which is told."""
    gear = fem.Gear(z=40, m_n=2 * mm, b=20 * mm, d_bore=30 * mm)
    floating = exugear.Bearing(table=([0.0, 10e-6, 20e-6], [0.0, 500.0, 3000.0]), damping_time=1e-5)
    fixed = exugear.Bearing(radial=2e8, axial=1e8, damping_time=1e-5)
    shafts = [exugear.Shaft(name, {0.0: fixed, 40 * mm: gear, 90 * mm: floating}) for name in ("fast", "slow")]
    law = exugear.MeshForce([0.0, 0.5], [0, 1 * mm], [[0, 3e5], [0, 3e5]], backlash=80e-6)
    box = exugear.Gearbox([exugear.Stage(*shafts, law, pair=fem.GearPair(gear, gear))])
    account = exugear.write_rexs(tmp_path / "written.rexs", box)
    assert "radial 1.5e+08 N/m stands for it" in str(account)
    again = exugear.read_rexs(tmp_path / "written.rexs", **QUICK).gearbox
    for shaft in again.shafts:
        assert [x.radial for x in shaft.bearings.values()] == pytest.approx([2e8, 1.5e8])
        assert [x.axial for x in shaft.bearings.values()] == pytest.approx([1e8, 0.0])


def test_what_is_not_written_of_shafts_and_bearings_is_told(tmp_path):
    """Each of these is lost between writing and reading."""
    gear = fem.Gear(z=40, m_n=2 * mm, b=20 * mm, d_bore=30 * mm)
    ribs = exugear.RollingBearing.cylindrical_roller(Z=14, D_w=8 * mm, D_pw=45 * mm, L_we=9 * mm, guidance=2e7)
    ceramic = exugear.RollingBearing.deep_groove(Z=9, D_w=15 * mm, D_pw=60 * mm, E=310e9).rolling()
    plain = exugear.Bearing(radial=5e8, axial=2e8, damping_time=2e-5, drag=exugear.Drag(0.5))
    fast = exugear.Shaft("fast", {0.0: ribs, 40 * mm: gear, 90 * mm: ceramic}, inertia=0.5, mass=20.0)
    slow = exugear.Shaft("slow", {0.0: plain, 40 * mm: gear, 90 * mm: plain}, gravity=(0, -20.0, 0))
    law = exugear.MeshForce([0.0, 0.5], [0, 1 * mm], [[0, 3e5], [0, 3e5]], backlash=80e-6)
    box = exugear.Gearbox([exugear.Stage(fast, slow, law, pair=fem.GearPair(gear, gear))])
    account = exugear.write_rexs(tmp_path / "written.rexs", box)
    lost = {(row.part, row.text) for row in account.rows}
    assert ("fast", "mass 20 kg and inertia 0.5 kg m^2 beyond those of its parts are not written; add a Disc") in lost
    assert ("fast at 0 mm", "guidance 2e+07 N/m is not written") in lost
    assert ("fast at 90 mm", "a cage that rolls, balls of E = 310 GPa, nu = 0.3 are not written") in lost
    assert ("slow at 0 mm", "damping_time 2e-05 s, Drag(constant=0.5 N m) are not written") in lost
    assert "gravity" in str(account) and "differs between the shafts" in str(account)
    after = exugear.read_rexs(tmp_path / "written.rexs", **QUICK).gearbox
    assert [shaft.gravity for shaft in after.shafts] == [(0.0, 0.0, 0.0)] * 2
    assert after.shafts[0].mass != pytest.approx(20.0)


def drawn_shaft(name: str, gears: dict, **options) -> exugear.Shaft:
    """A shaft with sections, a fixed ball bearing, a roller bearing, and a force beyond it."""
    ball = exugear.RollingBearing.deep_groove(Z=9, D_w=9 * mm, D_pw=46 * mm, C=21e3, clearance=8e-6, damping_time=1e-5)
    roller = exugear.RollingBearing.cylindrical_roller(
        Z=14, D_w=7 * mm, D_pw=46 * mm, L_we=8 * mm, C=28e3, clearance=4e-6, damping_time=1e-5
    )
    force = exugear.ExternalForce(x=100.0, y=-900.0, z=50.0, moment_x=3.0)
    parts = gears | {0.0: ball, 100 * mm: roller, 120 * mm: force}
    sections = [(30 * mm, 60 * mm), (26 * mm, 70 * mm, 10 * mm)]
    return exugear.Shaft(name, parts, sections=sections, start=-10 * mm, gravity=(0, -9.80665, 0), **options)


def test_sections_rolling_bearings_forces_and_gravity_are_written_and_read_again(tmp_path):
    gear = fem.Gear(z=40, m_n=2 * mm, b=20 * mm, beta=12 * deg, d_bore=30 * mm)
    mate = fem.Gear(z=41, m_n=2 * mm, b=20 * mm, beta=-12 * deg, d_bore=30 * mm)
    pair = fem.GearPair(gear, mate)
    ste = fem.ste_map(pair, [0, 50.0, 100.0], np.arange(4) / 4, np.outer([0, 1e-6, 2e-6], np.ones(4)))
    shafts = [drawn_shaft(name, {40 * mm: x}) for name, x in (("fast", gear), ("slow", mate))]
    box = exugear.Gearbox([exugear.Stage(*shafts, ste, backlash=80e-6)])
    belt = {"fast": {0.0: exugear.ExternalForce(x=100.0)}}
    case = exugear.LoadCase("cruise", 300 * rpm, 50.0, torques={"slow": -50.0, "third": 2.0}, forces=belt)
    account = exugear.write_rexs(tmp_path / "drawn.rexs", box, [case])
    assert "torques on third and forces on fast are not written" in str(account)
    model = exugear.read_rexs(tmp_path / "drawn.rexs", mesh="iso6336", progress=False)
    assert not [row for row in account.rows if "bearing" in row.text and "damping" not in row.text]
    for before, after in zip(box.shafts, model.gearbox.shafts, strict=True):
        assert np.array(after.sections) == pytest.approx(np.array(before.sections))
        assert (after.start, after.mass, after.torque_at) == pytest.approx(
            (before.start, before.mass, before.end_position)
        )
        assert after.gravity == pytest.approx(before.gravity)
        assert [type(x) for x in after.bearings.values()] == [exugear.RollingBearing] * 2
        for old, new in zip(before.bearings.values(), after.bearings.values(), strict=True):
            assert repr(new) == repr(old)
        assert [(x, force.wrench) for x, force in after.forces] == [
            (pytest.approx(x), pytest.approx(force.wrench)) for x, force in before.forces
        ]
    (case,) = model.spectrum
    assert (case.speed, case.load) == pytest.approx((300 * rpm, 50.0))


def test_sections_overlap_have_gaps_and_end_before_bearings(tmp_path):
    """The outermost surface counts; a gap has the smaller diameter of its neighbours; both are told."""
    data = two_stages()
    shaft = data.ids["fast"]
    section = next(x for x in data.components if x["type"] == "shaft_section")
    section["attributes"]["length"] = 40.0, "mm"
    ends = {f"outer_diameter_{end}": (d, "mm") for end, d in (("begin", 24.0), ("end", 36.0))}
    for begin, length in ((60.0, 20.0), (70.0, 15.0)):
        at = {"u_coordinate_on_shaft": (begin, "mm"), "length": (length, "mm")}
        data.relate("assembly", assembly=shaft, part=data.add("shaft_section", "", **at, **ends))
    model = read(data, tmp_path, shafts="elastic")
    fast = model.gearbox.driving
    assert fast.start == 0 and sum(section[1] for section in fast.sections) == pytest.approx(90 * mm)
    at = np.cumsum([section[1] for section in fast.sections])

    def diameter(z: float) -> float:
        return fast.sections[int(np.searchsorted(at, z))][0] / mm

    assert diameter(10 * mm) == pytest.approx(30)
    assert 24 < diameter(50 * mm) < 26
    assert told(model, "assumed", "gap at 50 mm closed") and told(model, "assumed", "sections extended")
    assert diameter(79 * mm) > diameter(61 * mm)
    assert all(shaft.sections for shaft in model.gearbox.shafts)


def test_rolling_bearings_keep_their_law_where_the_file_holds_their_sizes(tmp_path):
    """Width and both capacities: by catalogue; with a free outer ring radial force alone; else linear and told."""
    data = two_stages()
    for component in data.components:
        if component["type"].startswith("rolling"):
            component["attributes"] |= {"width": (19.0, "mm"), "static_capacity": (16.0, "kN")}
    model = read(data, tmp_path, bearings="rolling")
    fixed, floating = model.gearbox.driving.bearings.values()
    assert isinstance(fixed, exugear.RollingBearing) and fixed.kind == "deep groove"
    assert fixed.C == 29e3 and told(model, "assumed", "deep groove bearing by its force law")
    assert isinstance(floating, exugear.Bearing) and floating.table is not None and floating.axial == 0
    lacking = read(two_stages(), tmp_path, bearings="rolling")
    assert all(bearing.linear for shaft in lacking.gearbox.shafts for bearing in shaft.bearings.values())
    case = model.load_cases[0]
    assert exugear.plan(model.gearbox, load=case.load).bearings["fast"]


@pytest.mark.parametrize("shafts", ["rigid", "elastic"])
def test_bearings_between_shafts_stand_on_the_shaft_inside(shafts, tmp_path):
    """A gear wheel on two bearings of the coaxial input shaft has these bearings, whose seats that shaft carries."""
    model = read(two_stages(coaxial=(62.0, 88.0)), tmp_path, shafts=shafts)
    seats = {("slow", z): ("fast", z) for z in (62 * mm, 88 * mm)}
    assert [(*map(pytest.approx, x),) for x in model.gearbox.between] == [("slow", 62 * mm), ("slow", 88 * mm)]
    assert {on for on, _ in model.gearbox.between.values()} == {"fast"} and len(seats) == 2
    assert told(model, "read", "carries slow") or told(model, "read", "stands on")
    assert not told(model, "assumed", "stands in the housing instead")
    data = exugear.load_distribution(model.gearbox, 10.0, mesh_stiffness=15e9)
    on_ground = [x for x in data["bearing"].values if not x.startswith("slow")]
    np.testing.assert_allclose(data["bearing_force"].sel(bearing=on_ground).sum("bearing"), 0.0, atol=1e-3)
    exugear.build(model.gearbox)


def test_forces_of_the_chosen_load_case_and_gravity_act_on_the_shafts(tmp_path):
    """u, v, w become z, x, y; the forces of another load case are one reading away."""
    data = two_stages()
    unit, load = (f"_{data.ids[name]}" for name in ("unit", "load"))
    data.components[data.ids["unit"] - 1]["attributes"] |= {
        "account_for_gravity": (True, ""),
        "direction_vector_gravity_w": (-1.0, ""),
    }
    for torque, force in ((50.0, 300.0), (70.0, 800.0)):
        forces = {"force_v_direction": (force, "N"), "force_u_direction": (-0.02 * force, "kN")}
        case = {unit: {"load_duration_fraction": (50.0, "%")}, load: {"torque_around_u_axis": (torque, "N m")} | forces}
        data.load_case(**case)
    first, second = (read(data, tmp_path, load_case=number) for number in (1, 2))
    for model, force in ((first, 300.0), (second, 800.0)):
        ((axial, acting),) = model.gearbox.driving.forces
        assert (axial, acting.wrench[:3]) == (0.0, pytest.approx((force, 0.0, -20 * force)))
        assert model.gearbox.driving.gravity == pytest.approx((0, -9.80665, 0))
    assert first.load_cases[1].forces["fast"][0.0].x == 800
    assert told(first, "assumed", "those of load case 1 act") and told(first, "read", "gravity along")
    with pytest.raises(ValueError, match=r"load_case must lie in \[1, 2\]"):
        read(data, tmp_path, load_case=3)


@pytest.mark.parametrize(("argument", "value"), [("shafts", "stiff"), ("bearings", "ball"), ("mesh", "fast")])
def test_unknown_choices_are_refused(argument, value, tmp_path):
    with pytest.raises(ValueError, match=f"{argument} must be"):
        read(two_stages(), tmp_path, **{argument: value})


def test_a_law_in_place_of_a_map_is_refused(tmp_path):
    law = exugear.MeshForce([0.0, 0.5], [0, 1 * mm], [[0, 3e5], [0, 3e5]])
    with pytest.raises(ValueError, match=r"mesh must return the map .* got MeshForce"):
        read(two_stages(), tmp_path, mesh=lambda pair, torque: law)


def test_json_and_archives_are_not_written(tmp_path):
    box = read(two_stages(), tmp_path).gearbox
    with pytest.raises(ValueError, match=r"path must name an XML file, .* got the suffix '.zip'"):
        exugear.write_rexs(tmp_path / "written.zip", box)
    assert not (tmp_path / "written.zip").exists()


def test_planetary_sets_are_not_written(tmp_path):
    with pytest.raises(ValueError, match="planetary sets are not written"):
        exugear.write_rexs(tmp_path / "written.rexs", read(planetary(), tmp_path).gearbox)
    assert not (tmp_path / "written.rexs").exists()


def test_a_ring_without_a_body_is_not_written(tmp_path):
    gear = fem.Gear(z=20, m_n=3 * mm, b=25 * mm, d_bore=25 * mm)
    pair = exugear.RingPair(gear, z=-62, a=-63 * mm)
    law = exugear.MeshForce([0.0, 0.5], [0, 1 * mm], [[0, 3e5], [0, 3e5]], backlash=80e-6)
    shafts = exugear.Shaft("in", {0.0: gear}), exugear.Shaft("ring", {0.0: pair.wheel}, inertia=0.05, mass=5.0)
    with pytest.raises(ValueError, match=r"stages \['in-ring'\] have a RingPair, .* give a fem.GearPair"):
        exugear.write_rexs(tmp_path / "written.rexs", exugear.Gearbox([exugear.Stage(*shafts, law, pair=pair)]))
    assert not (tmp_path / "written.rexs").exists()


def test_allowances_of_the_tooth_thickness_are_written(tmp_path):
    """Tooth thickness, root and bearing forces as before; the mate of a thick tooth would be without backlash."""
    thin = fem.Gear(z=20, m_n=3 * mm, b=30 * mm, d_bore=20 * mm, x=0.3, s_n=5.0 * mm, rho_f=0.5 * mm)
    mate = fem.Gear(z=61, m_n=3 * mm, b=30 * mm, d_bore=60 * mm, x=-0.1)
    bearing = exugear.Bearing(radial=2e8, axial=1e8, damping_time=1e-5)
    needle = exugear.RollingBearing.needle(Z=24, D_w=3 * mm, D_pw=40 * mm, L_we=16 * mm, damping_time=1e-5)
    ends = {0.0: bearing, 90 * mm: needle}
    shafts = [exugear.Shaft(name, ends | {40 * mm: x}) for name, x in (("fast", thin), ("slow", mate))]
    law = exugear.MeshForce([0.0, 0.5], [0, 1 * mm], [[0, 3e5], [0, 3e5]], backlash=80e-6)
    box = exugear.Gearbox([exugear.Stage(*shafts, law, pair=fem.GearPair(thin, mate))])
    exugear.write_rexs(tmp_path / "written.rexs", box)
    after = exugear.read_rexs(tmp_path / "written.rexs", **QUICK | {"bearings": "rolling"}).gearbox
    assert after.stages[0].pair.pinion.s_n == pytest.approx(5.0 * mm)
    assert after.stages[0].pair.backlash == pytest.approx(box.stages[0].pair.backlash)
    forces = [
        exugear.load_distribution(x, load=50.0, mesh_stiffness=15e9)["bearing_force"].values for x in (box, after)
    ]
    assert forces[1] == pytest.approx(forces[0], abs=1e-6)


def test_what_is_not_written_of_rings_shafts_and_meshes_is_told(tmp_path):
    pinion = fem.Gear(z=20, m_n=3 * mm, b=25 * mm, d_bore=25 * mm)
    ring = fem.Gear(z=-62, m_n=3 * mm, b=25 * mm, d_a=181.5 * mm, d_f=194 * mm, d_rim=240 * mm)
    pair, law = fem.GearPair(pinion, ring), exugear.MeshForce([0.0, 0.5], [0, 1 * mm], [[0, 3e5], [0, 3e5]])
    sections = [(25 * mm, 100 * mm)]
    middle = exugear.Shaft(
        "middle", {20 * mm: pinion, 70 * mm: pinion}, sections=sections, damping_ratio=0.03, torque_at=90 * mm
    )
    wheels = [exugear.Shaft(name, {at: ring}, transverse=0.9) for name, at in (("first", 20 * mm), ("last", 70 * mm))]
    rubbing = exugear.MeshFriction.of_pair(pair, 0.05)
    stages = [exugear.Stage(middle, x, law, pair=pair, friction=rubbing, phase=0.0) for x in wheels]
    box = exugear.Gearbox(stages, driving=wheels[0], driven=wheels[1])
    account = str(exugear.write_rexs(tmp_path / "written.rexs", box))
    for words in (
        "rim up to a diameter of 240 mm is not written",
        "damping_ratio 0.03 of its modes is not written",
        "torque_at 90 mm is not written",
        "transverse inertia 0.9 kg m^2 beside that of its parts is not written",
        "force law, damping 0 N s/m, friction and phase 0 are not written",
    ):
        assert words in account


def test_meshes_of_several_outputs_reach_as_far_as_their_loads(tmp_path):
    """The last shaft takes the rest of the torques: the first mesh carries all, the second the rest."""
    data, asked = two_stages(), []

    def law(pair, torque):
        asked.append(torque)
        te = torque / 2e10 * np.outer([0, 1, 2], np.ones(4))
        return fem.ste_map(pair, [0, torque, 2 * torque], np.arange(4) / 4, te)

    middle = next(x["id"] for x in data.components if x["name"] == "middle")
    second = data.add("external_load", "", transmits_torque=(True, "none"), torque_around_u_axis=(30.0, "N m"))
    data.relate("assembly", assembly=middle, part=second)
    at_middle = 40 * 47 / 25
    model = read(data, tmp_path, mesh=law)
    assert model.gearbox.driven.name == "slow"
    assert model.load_cases[0].load == pytest.approx((at_middle - 30) * 55 / 24)
    assert asked == pytest.approx([40, at_middle - 30])
    assert told(model, "assumed", "load is the torque on 'slow' alone; runs take those on ['middle'], too, by loads=")
    data.components[second - 1]["attributes"]["torque_around_u_axis"] = (at_middle, "N m")
    asked.clear()
    idle = read(data, tmp_path, mesh=law)
    assert asked == pytest.approx([40, 100]) and told(idle, "assumed", "as no load case loads it")


def test_the_driving_shaft_takes_the_torques_of_all_outputs(tmp_path):
    """Where the file holds those of all outputs and none on the driving shaft."""
    data = two_stages()
    middle, loads = (next(x["id"] for x in data.components if x["name"] == "middle")), data.ids["load"]
    data.components[loads - 1]["attributes"].pop("torque_around_u_axis")
    data.components[loads]["attributes"]["torque_around_u_axis"] = (-50.0, "N m")
    third = data.add("external_load", "", transmits_torque=(True, "none"), torque_around_u_axis=(30.0, "N m"))
    data.relate("assembly", assembly=middle, part=third)
    model = read(data, tmp_path)
    (case,) = model.load_cases
    given = {"slow": 50.0, "middle": 30.0}
    assert case.load == pytest.approx(given[model.gearbox.driven.name])
    on_pinions = [stage.mesh["torque"].values[-1] / 1.5 for stage in model.gearbox.stages]
    assert on_pinions == pytest.approx([(30 + 50 * 24 / 55) * 25 / 47, 50 * 24 / 55])


@pytest.mark.slow
def test_from_a_file_to_the_resonance_table(tmp_path):
    """As the documents say, in five lines, with maps by finite elements."""
    model = exugear.read_rexs(two_stages().write(tmp_path / "gearbox.rexs"), progress=False)
    case = model.load_cases[0]
    run = exugear.run_up(
        exugear.build(model.gearbox), speed=(0, case.speed), load=case.load, duration=2.0, progress=False
    )
    table = exugear.resonances(run)
    assert table.sizes and float(np.ptp(run.data["dte"].values)) > 0
