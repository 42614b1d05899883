"""The plan of planetary sets: one resonance a set, and what is skipped, with the reason."""

import numpy as np
import pytest
from planetary_boxes import PIN, planar_box, planetary_box, waving_law

import exugear


@pytest.mark.parametrize("planets", [3, 4])
def test_a_set_has_one_resonance_that_is_a_mode_of_the_whole_set(planets):
    """Equal planets have modes of equal strain: each mesh alone named another one of them."""
    model = exugear.build(planar_box(law=waving_law(amplitude=0.0), bearings=PIN, planets=planets))
    named = [line for line in str(model.plan).splitlines() if line.startswith("resonance of")]
    assert len(named) == 1 and named[0].startswith("resonance of the planetary set on carrier, all meshes together")
    (resonances,) = set(model.plan.mesh_resonances.values())
    for resonance, drive in zip(resonances, ("held", "free"), strict=True):
        modes = exugear.modes(model, load=400.0, drive=drive)
        nearest = int(np.abs(modes["frequency"].values - resonance).argmin())
        assert float(modes["frequency"][nearest]) == pytest.approx(resonance, rel=1e-3)
        strain = modes["energy_share"].sel(element=list(model.gearbox.labels)).sum("element")
        assert float(strain[nearest]) == pytest.approx(float(strain.max()), abs=1e-3)


def test_the_plan_says_what_a_set_leaves_out_and_why():
    spinning, on_pins = (str(exugear.plan(box)) for box in (planetary_box(), planar_box()))
    assert "planetary set on carrier: 3 planets on ideal pins (no pin= given): skipped is how pins yield" in spinning
    assert "sun, carrier, ring on ideal axes (no bearings given): skipped is how they move sideways" in spinning
    assert "3 planets on elastic pins move in the plane: skipped are tilt and axial motion" in on_pins
    assert "sun on bearings move sideways, carrier, ring on ideal axes" in on_pins
    assert "all planets mesh in phase" in spinning
    assert "skipped: bending of the ring between the planets" in on_pins and "bending of the carrier" in on_pins
