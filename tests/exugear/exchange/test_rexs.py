"""REXS files: what is read in each container and version, what is told, and what is refused."""

import base64
import zipfile

import numpy as np
import pytest
from rexs_files import RexsData, planetary, two_stages

import exugear
import fem
from fem.units import deg, mm, rpm

QUICK = {"mesh": "iso6336", "progress": False}


def read(data: RexsData, folder, suffix: str = ".rexs"):
    return exugear.read_rexs(data.write(folder / f"model{suffix}"), **QUICK)


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
    flank = read(data, tmp_path).gearbox.stages[0].pair.pinion.flank
    assert [repr(part) for part in (*flank.left, *flank.right)] == [
        repr(fem.LeadCrowning(5e-6)),
        repr(fem.TipRelief(20e-6, d_Ca=54 * mm)),
    ]


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
        (lambda folder: _text(folder, "gearbox"), "neither XML nor JSON"),
        (lambda folder: _text(folder, ENTITY), "declares a document type or entities"),
        (lambda folder: _text(folder, "<html></html>"), "the root of a REXS file is <model>"),
        (lambda folder: _text(folder, "PK\x03\x04 broken"), "broken or encrypted zip archive"),
    ],
)
def test_broken_files_are_refused_with_the_remedy(write, words, tmp_path):
    with pytest.raises(ValueError, match=words):
        exugear.read_rexs(write(tmp_path), **QUICK)


def _text(folder, text: str):
    (folder / "model.rexs").write_text(text)
    return folder / "model.rexs"


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


def test_planetary_sets_are_not_written(tmp_path):
    with pytest.raises(ValueError, match="planetary sets are not written"):
        exugear.write_rexs(tmp_path / "written.rexs", read(planetary(), tmp_path).gearbox)
    assert not (tmp_path / "written.rexs").exists()


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
