"""Fields of a pair in contact: Hertz, mirror images, files, refusals."""

import sys
from dataclasses import replace
from pathlib import Path

import meshio
import numpy as np
import pytest
from loaded_gears import ROUGH, helical_gear, hertz_load, loaded_contacts
from paper_gears import few_teeth, paper_pair

import fem
from fem import Density, stress
from fem.units import MPa, mm, um

sys.path.insert(0, str(Path(__file__).parents[3] / "examples"))


import korta_fields

TINY = Density(flank=4, fillet=1, tooth=2, rim=1, body=1, teeth=1, width=2)
COARSE = Density(flank=8, fillet=2, tooth=2, rim=2, body=3, width=2)


@pytest.fixture(scope="module", name="single_contact")
def single_contact_fixture():
    return stress.plane_fields(paper_pair(), 150.0, 0.0, density=COARSE, refine=4, resolution=ROUGH)


def test_pressure_is_hertzian(single_contact):
    (loaded,) = loaded_contacts(paper_pair(), 150.0, [0.0], resolution=ROUGH)
    _, _, peak = hertz_load(loaded.state.quantities.line_load[0])
    for field in single_contact:
        assert field.pressure.max() == pytest.approx(peak, rel=0.01)


def test_pressed_flanks_touch(single_contact):
    """Displacement closes the overlap by 9 um of transmission error, in plane strain to 2 % of that."""
    pair = paper_pair()
    along = np.array([np.sin(pair.alpha_wt), np.cos(pair.alpha_wt)])
    flanks = []
    for field in single_contact:
        pressed = field.pressure > 0.3 * field.pressure.max()
        deformed = (field.points + field.displacement)[:, pressed]
        order = np.argsort(deformed[0])
        flanks.append(np.stack([np.array([along[1], -along[0]]) @ deformed, along @ deformed])[:, order])
    (pinion_position, pinion), (wheel_position, wheel) = flanks
    common = (pinion_position > wheel_position.min()) & (pinion_position < wheel_position.max())
    gap = np.interp(pinion_position[common], wheel_position, wheel) - pinion[common]
    assert np.ptp(gap) < 0.05 * um
    assert np.abs(gap).max() < 0.02 * 9.12 * um
    assert single_contact[0].deformed(1.0) == pytest.approx(single_contact[0].points + single_contact[0].displacement)


def test_flank_may_begin_on_the_base_circle():
    """As with few teeth whose fillet is given; stress is higher in a smaller fillet than the rack's."""
    pairs = [fem.GearPair(gear, gear) for gear in (few_teeth(fillet=0.5 * mm), few_teeth())]
    assert pairs[0].pinion.roll_form == 0
    options = {"density": COARSE, "refine": 4, "resolution": ROUGH}
    (sharp, _), (rack, _) = (stress.plane_fields(pair, 30.0, 0.0, **options) for pair in pairs)
    assert sharp.pressure.max() == pytest.approx(rack.pressure.max(), rel=0.02)
    assert rack.root_stress < sharp.root_stress < 1.5 * rack.root_stress


@pytest.fixture(scope="module", name="double_contact")
def double_contact_fixture():
    return [
        stress.plane_fields(paper_pair(), 150.0, phase, density=COARSE, refine=4, resolution=ROUGH)
        for phase in (0.4, 0.6)
    ]


def test_swapped_gears_mirror_the_fields(double_contact):
    """An equal wheel behind the pitch point is the pinion as far before it, turned by pi.

    To 0.1 %: the same flank belongs to another tooth of the mesh, which has teeth on a few pitches only.
    """
    before, after = double_contact
    for pinion, wheel in ((before[0], after[1]), (after[0], before[1])):
        for name in ("von_mises", "pressure"):
            on_pinion, on_wheel = getattr(pinion, name), getattr(wheel, name)
            assert on_wheel.max() == pytest.approx(on_pinion.max(), rel=1e-3)
            peaks = pinion.points[:, np.argmax(on_pinion)], wheel.points[:, np.argmax(on_wheel)]
            assert sum(peaks) == pytest.approx([paper_pair().a, 0], abs=0.01 * mm)
        assert wheel.root_stress == pytest.approx(pinion.root_stress, rel=1e-3)
        tips = (np.hypot(*field.displacement).max() for field in (pinion, wheel))
        assert next(tips) == pytest.approx(next(tips), rel=1e-3)


@pytest.fixture(scope="module", name="solids")
def solids_fixture():
    return stress.solid_fields(paper_pair(), 150.0, 0.0, density=replace(COARSE, width=1), resolution=ROUGH)


def test_solid_bends_like_the_section(solids, single_contact):
    """The middle of the width is nearly in plane strain."""
    for solid, section in zip(solids, single_contact, strict=True):
        assert solid.root_stress == pytest.approx(section.root_stress, rel=0.03)
        largest = np.hypot(*solid.displacement[:2]).max()
        assert largest == pytest.approx(np.hypot(*section.displacement).max(), rel=0.01)
        lower, upper = (solid.von_mises[np.isclose(solid.points[2], z)].max() for z in (-11.5 * mm, 11.5 * mm))
        assert lower == pytest.approx(upper, rel=1e-6)


@pytest.fixture(scope="module", name="hands")
def hands_fixture():
    pairs = [fem.GearPair(helical_gear(hand), helical_gear(-hand)) for hand in (1, -1)]
    return [stress.solid_fields(pair, 150.0, 0.2, density=TINY, resolution=ROUGH) for pair in pairs]


def test_opposite_hand_mirrors_the_fields(hands):
    for right, left in zip(*hands, strict=True):
        mirror = np.array([[1.0], [1.0], [-1.0]])
        right_order, left_order = (np.lexsort(np.round(p / um)) for p in (right.points, left.points * mirror))
        assert (left.points * mirror)[:, left_order] == pytest.approx(right.points[:, right_order], abs=1e-9)
        assert left.von_mises[left_order] == pytest.approx(right.von_mises[right_order], rel=1e-5, abs=1e3)
        displacement = (left.displacement * mirror)[:, left_order]
        tolerance = 1e-5 * np.abs(displacement).max()
        assert displacement == pytest.approx(right.displacement[:, right_order], abs=tolerance)


@pytest.mark.parametrize("level", ["single_contact", "solids"])
def test_written_and_read_fields_are_equal(level, request, tmp_path):
    fields = request.getfixturevalue(level)
    path = stress.save_vtu(fields, tmp_path / "pair.vtu")
    assert [file.name for file in tmp_path.iterdir()] == ["pair.vtu"]
    read, dim = meshio.read(path), len(fields[0].points)
    assert read.points.T[:dim] == pytest.approx(np.hstack([field.points for field in fields]), abs=0)
    assert read.point_data["displacement"].T[:dim] == pytest.approx(np.hstack([f.displacement for f in fields]), abs=0)
    for name in ("von_mises", "principal", "pressure"):
        assert read.point_data[name] == pytest.approx(np.concatenate([getattr(f, name) for f in fields]), abs=0)
    cells = np.vstack([block.data for block in read.cells])
    a, b, c, *_, e = (read.points[cells[:, i]] for i in (0, 1, 2, -4 if dim == 3 else 2))
    size = np.einsum("ni,ni->n", np.cross(b - a, c - a), e - a) if dim == 3 else np.cross(b - a, c - a)[:, 2]
    assert size.min() > 0 or dim == 2
    assert len(cells) == sum(field.cells.shape[1] for field in fields)


def test_an_interrupted_file_leaves_the_old_one(solids, tmp_path, monkeypatch):
    path = stress.save_vtu(solids, tmp_path / "pair.vtu")
    before = path.read_bytes()

    def fails(part, *_, **__):
        part.write_bytes(b"half")
        raise OSError("disk full")

    monkeypatch.setattr(meshio, "write", fails)
    with pytest.raises(OSError, match="disk full"):
        stress.save_vtu(solids, path)
    assert path.read_bytes() == before and list(tmp_path.iterdir()) == [path]


def test_contacts_like_the_papers_figure(single_contact, double_contact):
    two = double_contact[0]
    assert len(korta_fields.contacts(single_contact[0])) == 1 and len(korta_fields.contacts(two[0])) == 2
    assert two[0].root_stress == pytest.approx(70 * MPa, rel=0.05)


@pytest.mark.slow
def test_figure_like_the_papers(single_contact, double_contact, tmp_path):
    korta_fields.draw_fields({"single": single_contact, "double": double_contact[0]}, tmp_path / "fields.png")
    assert (tmp_path / "fields.png").stat().st_size > 100_000


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"torque": 0.0}, "torque must be > 0"),
        ({"torque": np.nan}, "torque must be > 0"),
        ({"torque": 150e3}, "torque must be finite"),
        ({"phase": 1.0}, "phases must increase"),
        ({"phase": np.nan}, "phases must be finite"),
        ({"offsets": fem.Offsets(misalignment=(0.0, 1e-4))}, "one value each"),
        ({"refine": 2}, "refine must be"),
        ({"refine": np.inf}, "refine must be"),
        ({"density": None}, r"density must be a fem\.Density"),
        ({"resolution": COARSE}, r"resolution must be a fem\.Resolution"),
        ({"offsets": {"misalignment": 1e-4}}, r"offsets must be a fem\.Offsets"),
        ({"pair": fem.GearPair(helical_gear(), helical_gear(-1))}, "take solid_fields"),
    ],
)
def test_bad_input_is_refused(changes, message):
    with pytest.raises(ValueError, match=message):
        stress.plane_fields(**{"pair": paper_pair(), "torque": 150.0, "phase": 0.0} | changes)


def test_bad_files_are_refused(single_contact, tmp_path):
    with pytest.raises(ValueError, match=r"\.vtu"):
        stress.save_vtu(single_contact, tmp_path / "pair.png")
    for fields in (single_contact[0], (), None):
        with pytest.raises(ValueError, match="fields must be"):
            stress.save_vtu(fields, tmp_path / "pair.vtu")
