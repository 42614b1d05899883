"""Load over the flanks: balance with the mesh force and its centroid, crowning, misalignment."""

from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from executors import Pickled
from loaded_gears import ROUGH, helical_gear
from paper_gears import paper_gear, paper_pair

import fem
from fem import Density
from fem.units import um

TORQUE, PHASES = 150.0, np.arange(4) / 4
COARSE = Density(flank=6, fillet=3, land=1, tooth=2, rim=2, body=2, width=1)
HELICAL = fem.GearPair(helical_gear(1), helical_gear(-1))
CROWNED = fem.GearPair(paper_gear(flank=[fem.LeadCrowning(10 * um)]), paper_gear(), a=paper_pair().a)


def distribution(pair: fem.GearPair, misalignment: float = 0.0, **options):
    offsets = fem.Offsets(misalignment=misalignment)
    return fem.load_distribution(pair, TORQUE, PHASES, offsets=offsets, resolution=ROUGH, progress=False, **options)


@pytest.mark.parametrize("pair", [paper_pair(), CROWNED, HELICAL], ids=["spur", "crowned", "helical"])
def test_line_loads_add_up_to_the_mesh_force_at_its_centroid(pair):
    """Levers of the forces on flanks that a tip edge touches differ from r_b by less than 1e-3."""
    offsets = fem.Offsets(misalignment=1e-4)
    ste = fem.static_transmission_error(pair, TORQUE, PHASES, offsets=offsets, resolution=ROUGH, progress=False)
    data = distribution(pair, 1e-4)
    force = (data["line_load"] * data["length"]).sel(torque=TORQUE) * np.cos(pair.beta_b)
    total = force.sum(["pair", "axial_position"])
    assert total.values * pair.pinion.r_b == pytest.approx(TORQUE, rel=1e-3)
    centroid = (force * data["axial_position"]).sum(["pair", "axial_position"]) / total
    assert centroid.values == pytest.approx(ste["centroid"].sel(torque=TORQUE).values, abs=2e-3 * pair.b)
    assert data["te"].values == pytest.approx(ste["te"].values, rel=1e-9)
    shared = set(ste["pair"].values) & set(data["pair"].values)
    for number in shared:
        share = force.sel(pair=number).sum("axial_position") / total
        assert share.values == pytest.approx(ste["load_share"].sel(torque=TORQUE, pair=number).values, abs=1e-3)
    assert float(data["pressure"].max()) == pytest.approx(float(ste["peak_pressure"].max()), rel=1e-9)


def edge_over_mean(data) -> float:
    load = data["line_load"].sel(torque=TORQUE, pair=0, phase=0.0)
    return float(load.isel(axial_position=[0, -1]).max() / load.mean())


def test_crowning_takes_load_from_the_ends_of_the_face():
    assert edge_over_mean(distribution(CROWNED)) < 0.8 * edge_over_mean(distribution(paper_pair()))


def test_misalignment_moves_the_load_towards_minus_z_and_its_mirror_image_towards_z():
    loads = [distribution(paper_pair(), angle)["line_load"].sel(torque=TORQUE) for angle in (2e-4, -2e-4)]
    centroids = [float((load * load["axial_position"]).sum() / load.sum()) for load in loads]
    assert centroids[0] < -0.02 * paper_pair().b
    assert centroids[1] == pytest.approx(-centroids[0], rel=1e-6)


def test_contact_lines_of_a_helical_pair_lie_along_the_base_helix():
    data = distribution(HELICAL)
    slope = np.gradient(data["path"].sel(pair=0, phase=0.25).values, data["axial_position"].values)
    assert slope == pytest.approx(np.tan(HELICAL.beta_b))
    assert float(data["path"].sel(pair=0, phase=0.25).mean()) == pytest.approx(0.25 * HELICAL.p_bt)


def test_a_load_distribution_keeps_its_pair_and_is_written_as_netcdf(tmp_path):
    data = distribution(replace(paper_pair()), stations=7)
    assert data["axial_position"].size == 7
    fem.save(data, tmp_path / "loads.nc")
    assert fem.pair_of(data) == paper_pair()


def test_results_hold_the_offsets_at_which_they_were_made():
    pair = paper_pair()
    offsets = fem.Offsets(a=pair.a + 0.2e-3, misalignment=1e-4, axial=1e-3, f_sigma_beta=2e-5)
    options = {"offsets": offsets, "resolution": ROUGH, "progress": False}
    ste = fem.static_transmission_error(pair, [TORQUE], [0.1], **options)
    loads, factors = (solve(pair, [TORQUE], [0.1], **options) for solve in (fem.load_distribution, fem.load_factors))
    stress = fem.root_stress(pair, [TORQUE], [0.1], density=COARSE, **options)
    for data in (loads, factors, stress):
        assert fem.pair_of(data) == fem.pair_of(ste)
        for name in ("axial", "f_sigma_beta", "f_sigma_delta", "resolution"):
            assert data.attrs[name] == ste.attrs[name]
    assert factors.attrs["misalignment"] == stress.attrs["misalignment"] == 1e-4
    assert loads.attrs["misalignment"] != 1e-4, "the sum in the plane of action"


@pytest.mark.parametrize("pair", [CROWNED, HELICAL], ids=["crowned", "helical"])
def test_contacts_that_other_processes_solve_are_the_same(pair):
    xr.testing.assert_identical(distribution(pair, 1e-4, executor=Pickled()), distribution(pair, 1e-4))
    options = {"resolution": ROUGH, "progress": False}
    factors = [fem.load_factors(pair, TORQUE, PHASES, **options, executor=executor) for executor in (Pickled(), None)]
    xr.testing.assert_identical(*factors)
