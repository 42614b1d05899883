"""The force centroid of a map beside the change of the potential over the misalignment: two results of one contact."""

import numpy as np
import pytest
from coarse_maps import ROUGH

import exugear
import fem
from fem.units import deg, mm, um

TILTS = np.array([-3e-5, 0, 3e-5])


def pair(*flank) -> fem.GearPair:
    size = {"m_n": 3 * mm, "b": 20 * mm}
    return fem.GearPair(fem.Gear(z=25, d_bore=20 * mm, flank=flank, **size), fem.Gear(z=40, d_bore=30 * mm, **size))


@pytest.mark.parametrize("middle", [0.0, 2e-4])
@pytest.mark.parametrize("flank", [(), (fem.LeadCrowning(4 * um), fem.HelixSlope(5 * um))], ids=["plain", "modified"])
def test_centroid_of_a_map_is_the_slope_of_its_potential_over_the_misalignment(flank, middle, measured):
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
    largest = max(np.abs(law.centroid[..., loaded]).max(), 0.1 * mm)
    measured(
        "force centroid of a map over 25 torques, over its largest distance", np.abs(difference).max() / largest, 0.02
    )


HELICAL = {"m_n": 2.5 * mm, "b": 20 * mm, "d_bore": 20 * mm}
WIDE_TILTS = (-6e-4, -3e-4, 0.0, 3e-4, 6e-4)


@pytest.fixture(scope="module")
def helical_map():
    """A map whose misalignments lie so far apart that light loads of one are beside lost contact of the next."""
    gears = fem.Gear(z=23, beta=18 * deg, **HELICAL), fem.Gear(z=41, beta=-18 * deg, **HELICAL)
    options = {
        "offsets": fem.Offsets(misalignment=WIDE_TILTS),
        "resolution": fem.Slices(ROUGH.density),
        "progress": False,
    }
    return fem.static_transmission_error(fem.GearPair(*gears), [0, 2, 5, 10, 20, 50, 100, 200, 400], 15, **options)


@pytest.fixture(scope="module")
def helical_laws(helical_map):
    """Laws of the map with its own force centroids, and by energy."""
    without = {"of the map": (), "by energy": ("centroid",)}
    return {
        name: exugear.MeshForce.from_ste(helical_map.drop_vars(names), backlash=0.1 * mm)
        for name, names in without.items()
    }


def test_centroid_by_energy_stays_on_the_face_down_to_the_loss_of_contact(helical_laws):
    law = helical_laws["by energy"]
    assert np.abs(law.centroid).max() < 1.03 * HELICAL["b"] / 2
    assert np.abs(law.centroid[[0, -1], :, :12]).max() > 0.95 * HELICAL["b"] / 2


@pytest.mark.parametrize("centroids", ["of the map", "by energy"])
@pytest.mark.parametrize("misalignment", [3e-4 + 1e-8, 1e-8, -1e-7, 3.25e-4])
def test_law_beside_a_misalignment_of_the_map_keeps_its_centroid_in_the_range_of_the_map(
    helical_laws, centroids, misalignment
):
    law = helical_laws[centroids]
    aligned = law.at(misalignment=misalignment)
    assert law.centroid.min() <= aligned.centroid.min()
    assert aligned.centroid.max() <= law.centroid.max()
    deflection = aligned.deflection_at(0.3, 3000.0)
    assert law(0.3, deflection, misalignment=misalignment) == pytest.approx(3000.0, rel=1e-3)
