"""The force centroid of a map beside the change of the potential over the misalignment: two results of one contact."""

import numpy as np
import pytest

import exugear
import fem
from fem.units import mm, um

TILTS = np.array([-3e-5, 0, 3e-5])


def pair(*flank) -> fem.GearPair:
    size = {"m_n": 3 * mm, "b": 20 * mm}
    return fem.GearPair(fem.Gear(z=25, d_bore=20 * mm, flank=flank, **size), fem.Gear(z=40, d_bore=30 * mm, **size))


@pytest.mark.parametrize("middle", [0.0, 2e-4])
@pytest.mark.parametrize("flank", [(), (fem.LeadCrowning(4 * um), fem.HelixSlope(5 * um))], ids=["plain", "modified"])
def test_centroid_of_a_map_is_the_slope_of_its_potential_over_the_misalignment(flank, middle):
    """Within 2 % of its largest distance from mid-plane, over load and phase, with and without misalignment.

    The torques lie close: between eight torques from 5 to 200 N m, interpolated, the same difference is 6 %.
    """
    offsets = fem.Offsets(misalignment=tuple((middle + TILTS).tolist()))
    torques = [0, *np.geomspace(0.5, 200, 24)]
    options = {"offsets": offsets, "resolution": fem.Slices(), "progress": False}
    ste = fem.static_transmission_error(pair(*flank), torques, 6, **options)
    law = exugear.MeshForce.from_ste(ste, backlash=0.2 * mm)
    by_energy = exugear.MeshForce.from_ste(ste.drop_vars("centroid"), backlash=0.2 * mm)
    loaded = law.force_table[0, 0] > 1000
    difference = (by_energy.centroid - law.centroid)[1][:, loaded]
    assert np.abs(difference).max() < 0.02 * max(np.abs(law.centroid[..., loaded]).max(), 0.1 * mm)
