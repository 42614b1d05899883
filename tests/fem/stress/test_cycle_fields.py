"""Fields over the mesh cycle: the root stress of single phases, the same elements at all phases."""

import numpy as np
import pytest
from loaded_gears import ROUGH, helical_gear
from paper_gears import paper_pair

import fem
from fem import Density
from fem.units import um

COARSE = Density(flank=6, fillet=3, land=1, tooth=2, rim=2, body=2, width=1)


def test_the_elements_under_the_contact_do_not_change_the_root_stress():
    """Root stress within 1 % of that with elements that resolve the contact, in the slice with the largest pressure."""
    end = 0.99 * paper_pair().b / 2
    ((*cycle,),) = fem.stress.cycle_fields(paper_pair(), 150.0, [0.3], axial=end, resolution=ROUGH)
    even = Density(flank=16, fillet=6, land=3, tooth=4, rim=4, body=4)
    single = fem.stress.plane_fields(paper_pair(), 150.0, 0.3, density=even, refine=4, resolution=ROUGH)
    for coarse, fine in zip(cycle, single, strict=True):
        assert coarse.root_stress == pytest.approx(fine.root_stress, rel=0.01)
        assert coarse.turn == pytest.approx(fine.turn, rel=1e-9)


def test_all_phases_share_the_elements_of_each_gear():
    pinions, wheels = zip(*fem.stress.cycle_fields(paper_pair(), 150.0, 4, resolution=ROUGH), strict=True)
    for fields in (pinions, wheels):
        assert len({field.points.shape for field in fields}) == 1
        assert np.array_equal(fields[0].cells, fields[-1].cells)
    turned = np.angle(
        np.exp(-2j * np.pi / 57 / 4) * complex(*pinions[1].points[:, 0]) / complex(*pinions[0].points[:, 0])
    )
    assert turned == pytest.approx(0, abs=10 * um / paper_pair().pinion.r_b), "a quarter of a pitch, but for the te"


def test_the_section_of_a_helical_pair_lies_in_its_solid():
    pair = fem.GearPair(helical_gear(1), helical_gear(-1))
    ((pinion, _),) = fem.stress.cycle_fields(pair, 100.0, [0.1], density=COARSE, resolution=ROUGH)
    solid, _ = fem.stress.solid_fields(pair, 100.0, 0.1, density=COARSE, resolution=ROUGH)
    middle = np.abs(solid.points[2]) < 1e-9
    at_tip = np.hypot(*pinion.points) > pair.pinion.r_a * (1 - 1e-6)
    assert pinion.points.shape[1] > middle.sum(), "more teeth"
    tips = middle & (np.hypot(*solid.points[:2]) > pair.pinion.r_a * (1 - 1e-6))
    largest, expected = (np.hypot(*u).max() for u in (pinion.displacement[:, at_tip], solid.displacement[:2, tips]))
    assert largest == pytest.approx(expected, rel=0.01)
    assert pinion.cells.shape[0] == 3


def test_both_end_faces_have_a_section_and_what_lies_beyond_has_none():
    b = paper_pair().b
    options = {"resolution": ROUGH, "density": COARSE}
    ends = [fem.stress.cycle_fields(paper_pair(), 150.0, [0.3], axial=z, **options)[0][0] for z in (-b / 2, b / 2)]
    assert ends[1].von_mises.max() == pytest.approx(ends[0].von_mises.max(), rel=1e-6)
    with pytest.raises(ValueError, match=r"axial must lie on the faces of both gears, .* got 11.6 mm"):
        fem.stress.cycle_fields(paper_pair(), 150.0, [0.3], axial=0.0116, **options)


def test_fields_need_a_load():
    with pytest.raises(ValueError, match="torque must be > 0 N m for a field, got 0"):
        fem.stress.cycle_fields(paper_pair(), 0.0)
