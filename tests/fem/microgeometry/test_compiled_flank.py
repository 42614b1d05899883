"""Material removed in compiled code against that of the modifications in numpy."""

import numpy as np
import pytest
from contacts import resolved_contacts, single_slice
from hypothesis import given, settings
from modified_pairs import material_removed
from paper_gears import paper_gear
from strategies import gears

import fem
from fem import Resolution
from fem.microgeometry.compiled_flank import ROUNDING, SHAPE, FlankSections, add_removed, compiled_flank, turned
from fem.units import mm, um


class Wave:
    """A modification that a user writes."""

    def removed(self, face, roll, axial):
        return 1 * um * np.sin(roll / mm) + 1e-3 * axial + 0.1 * um * (np.asarray(face.tooth) % 3)


class Broken:
    def removed(self, face, roll, axial):
        raise ValueError("a modification that fails")


@given(gears())
@settings(max_examples=60)
def test_compiled_material_is_that_of_the_modifications(gear):
    face, flank = gear.face, (*gear.drive_flank, Wave())
    compiled, roll = compiled_flank(flank, face), np.linspace(0.5 * face.roll_form, 1.1 * face.roll_tip, 50)
    records = single_slice(fem.GearPair(paper_gear(), paper_gear(), a=150 * mm), 0.0).mesh.geometry
    extent = records.gears[0]
    for name in ("roll_form", "roll_tip", "r_b"):
        extent[name] = getattr(face, name)
    extent["users"] = compiled.users.key
    tooth, axial, shift = np.array([-1, 0, 2]), np.array([-0.6, 0.0, 0.3]) * gear.b, np.array([1e-5, 0.0, -1e-5])
    total, rolls = np.zeros((3, roll.size)), np.tile(roll, (3, 1))
    sections = FlankSections(tooth, axial, shift)
    for role in (SHAPE, ROUNDING):
        add_removed(compiled.rows, compiled.table, extent, role, 2.0, sections, rolls, total)
    total += [[2 * turned(compiled.rows, compiled.table, k)] for k in tooth]
    expected = [material_removed(flank, face, roll + ahead, z, tooth=k) for k, z, ahead in zip(*sections, strict=True)]
    assert total == pytest.approx(2 * np.array(expected), rel=1e-12, abs=1e-18)


def contact(flank):
    pair = fem.GearPair(paper_gear(flank=flank), paper_gear(), a=150 * mm)
    (resolved,) = resolved_contacts(pair, Resolution(), [0.3], misalignment=1e-5)
    return resolved


@pytest.mark.slow
def test_a_modification_in_python_gives_the_contact_of_the_same_one_that_is_known():
    class Crowning:
        def removed(self, face, roll, axial):
            return 10 * um * (2 * axial / face.width) ** 2 + 0 * roll

    written, known = (contact(part).state(2000.0) for part in (Crowning(), fem.LeadCrowning(10 * um)))
    assert written.te == pytest.approx(known.te, rel=1e-9)
    assert written.quantities.peak_pressure[0] == pytest.approx(known.quantities.peak_pressure[0], rel=1e-6)


def test_errors_of_a_modification_in_python_reach_the_user():
    with pytest.raises(ValueError, match="a modification that fails"):
        contact(Broken()).state(2000.0)
