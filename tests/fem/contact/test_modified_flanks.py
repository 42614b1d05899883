"""Modified and misaligned flanks: gap in metres, references of independent finite elements, no new finite elements."""

import numpy as np
import pytest
from compliance_products import across, elastic_body
from contacts import contact_of
from measured_rows import deviation
from modified_pairs import ALL_KINDS, end_relieved
from paper_gears import paper_gear
from twins import plane_twin, twin_te

import fem
from fem import Density
from fem.units import mm, um


def modified(*parts) -> fem.Gear:
    return paper_gear(flank=parts)


def numbers(pinion, wheel, **options) -> list[float]:
    """Mean and peak to peak at 150 and at 350 N m [um]."""
    pair = fem.GearPair(pinion, wheel, a=150 * mm)
    te = fem.static_transmission_error(pair, [150, 350], 30, progress=False, **options)["te"].values / um
    return [te[0].mean(), np.ptp(te[0]), te[1].mean(), np.ptp(te[1])]


def test_crowning_of_10_um(measured):
    mean_150, peak_150, mean_350, peak_350 = numbers(modified(fem.LeadCrowning(10 * um)), paper_gear())
    measured.cells("lead crowning 10 µm, 150 N m", f"{mean_150:.3f} / {peak_150:.3f}")
    assert [mean_150, mean_350] == pytest.approx([10.55, 20.26], rel=0.007)
    assert [peak_150, peak_350] == pytest.approx([3.12, 5.99], rel=0.012)


def test_misalignment_of_half_a_milliradian(measured):
    mean_150, peak_150, mean_350, peak_350 = numbers(
        paper_gear(), paper_gear(), offsets=fem.Offsets(misalignment=0.5e-3)
    )
    measured.cells("misalignment 0.5 mrad, 150 N m", f"{mean_150:.3f} / {peak_150:.3f}")
    assert [mean_150, mean_350] == pytest.approx([7.45, 16.90], rel=0.007)
    assert [peak_150, peak_350] == pytest.approx([2.82, 5.97], rel=0.012)


def plane_strain_te(pair: fem.GearPair, torque: float, phases: int) -> np.ndarray:
    """Transmission error [m] of a pair of equal gears as its section in plane strain."""
    twin = plane_twin(pair.pinion, Density(flank=26), 2)
    return np.array([twin_te(pair, twin, i / phases, torque / pair.pinion.r_b) for i in range(phases)])


def test_mean_under_tip_relief_in_plane_strain():
    """15 um linear over the last 2.5 mm of roll length, both gears."""
    gear = modified(fem.TipRelief(15 * um, 2.5 * mm))
    for torque, mean in ((150, 9.218), (350, 19.489)):
        te = plane_strain_te(fem.GearPair(gear, gear, a=150 * mm), torque, 30) / um
        assert np.mean(te) == pytest.approx(mean, rel=0.005)


def test_tip_relief_between_nodes_in_plane_strain(measured):
    """The reference is met by a relief that is linear between nodes 0.08 mm apart, as finite elements have it.

    The peak to peak at 150 N m depends on these nodes: two teeth touch at the edge of the relief at phase 0.4, where te
    rises by 14 nm per thousandth of a pitch.
    """
    plain, relief = paper_gear(), fem.TipRelief(15 * um, 2.5 * mm)
    arcs = plain.roll_tip**2 / (2 * plain.r_b) - np.arange(40)[::-1] * 0.08 * mm
    roll = np.sqrt(2 * plain.r_b * arcs)
    nodes = fem.Grid(roll, (-1 * mm, 1 * mm), relief.removed(plain.face, roll[:, None], np.zeros(2)))
    gear = modified(nodes)
    for torque, expected in ((150, [9.218, 1.080]), (350, [19.489, 3.405])):
        te = plane_strain_te(fem.GearPair(gear, gear, a=150 * mm), torque, 30) / um
        assert [te.mean(), np.ptp(te)] == pytest.approx(expected, rel=0.005)
        measured.cells(
            f"the relief linear between nodes 0.08 mm apart, {torque} N m: peak to peak", f"{np.ptp(te):.3f}"
        )


def test_force_is_normal_to_both_flanks_on_the_edge_of_a_relief():
    """Half-planes do not turn one another: the mean normals of both flanks agree with the direction of the force.

    The wheel carries the strips, and the pinion's relief begins among them.
    """
    relief = fem.TipRelief(15 * um, 2.5 * mm)
    gear = modified(relief)
    twin = plane_twin(gear, Density(flank=26), 2)
    state = contact_of(fem.GearPair(gear, gear, a=150 * mm), (twin, twin), 0.4, 1).state(50 / gear.r_b)
    tooth = state.slices.number == 0
    share, (pinion, wheel) = (state.strip_force / state.force.sum())[tooth], state.strips.tilts[:, tooth]
    arcs, step = state.strips.arcs[0, tooth], state.strips.width[tooth] / 2
    ahead, behind = (relief.removed(gear.face, np.sqrt(2 * gear.r_b * (arcs + s)), 0.0) for s in (step, -step))
    slope = (ahead - behind) / (2 * step)
    assert share.sum() == pytest.approx(1)
    assert np.ptp(slope[share > 0]) > 0.01
    assert (share * wheel).sum() == pytest.approx(0, abs=1e-4)
    assert (share * pinion).sum() == pytest.approx((share * slope).sum(), abs=1e-4)


def test_plane_strain():
    for torque, mean, peak_to_peak in ((150, 7.369, 2.653), (350, 16.42, 5.848)):
        te = plane_strain_te(fem.GearPair(paper_gear(), paper_gear(), a=150 * mm), torque, 30) / um
        assert np.mean(te) == pytest.approx(mean, rel=0.0015)
        assert np.ptp(te) == pytest.approx(peak_to_peak, rel=0.004)


def test_helix_slope_is_misalignment():
    pair = fem.GearPair(modified(fem.HelixSlope(11.5 * um)), paper_gear(), a=150 * mm)
    plain = fem.GearPair(paper_gear(), paper_gear(), a=150 * mm)

    def te(pair: fem.GearPair, misalignment: float) -> np.ndarray:
        offsets = fem.Offsets(misalignment=misalignment)
        return fem.static_transmission_error(pair, 150, 4, offsets=offsets, progress=False)["te"].values

    misaligned = te(plain, 0.5e-3)
    assert te(pair, 0.0) == pytest.approx(misaligned, rel=1e-4)
    assert te(plain, -0.5e-3) == pytest.approx(misaligned, rel=1e-6)


def test_unloaded_error_is_the_smallest_gap():
    pair = fem.GearPair(modified(fem.ProfileCrowning(5 * um)), paper_gear(), a=150 * mm)
    te = fem.static_transmission_error(pair, [0, 1e-3], 6, progress=False)["te"].values
    assert te[0].min() > -1e-14
    assert 0.3 * um < np.ptp(te[0]) < 5 * um
    assert te[1] == pytest.approx(te[0], abs=0.01 * um)


@pytest.mark.parametrize("beta", [0.0, 0.26])
def test_light_loads_on_edges_across_the_width(beta, measured):
    """Teeth touch first where end reliefs begin, on a short line: slices across such edges err by 3 %."""
    pair = end_relieved(beta)
    few, many = (
        fem.static_transmission_error(pair, [5], 5, resolution=fem.Resolution(slices=n), progress=False)["te"].values
        for n in (20, 60)
    )
    measured("end reliefs of 30 µm that begin sharply, 5 N m, 20 slices", deviation(few, many), 4e-3)


def test_modifications_need_no_new_finite_elements(folder):
    density = Density(flank=6, fillet=1, tooth=2, rim=1, body=1, teeth=1, width=1)
    elastic_body(paper_gear(), density)
    known = sorted(folder.iterdir())
    elastic_body(modified(*ALL_KINDS), density)
    assert sorted(folder.iterdir()) == known


def test_halves_of_the_width_superpose():
    """Evenly loaded, the whole width gives what one half of it gives."""
    density = Density(flank=6, fillet=1, tooth=2, rim=1, body=1, teeth=1, width=2)
    half, whole = (elastic_body(paper_gear(), density, whole=w) for w in (False, True))
    end = np.array([11.5 * mm])
    on_half, on_whole = across(half, 0 * end, end)[:, 0], across(whole, -end, end)[:, 0]
    half_yields = np.einsum("y,dyhzk,z->dhk", on_half, half.blocks, on_half)
    whole_yields = np.einsum("y,dyhzk,z->dhk", on_whole, whole.blocks, on_whole)
    assert 2 * whole_yields == pytest.approx(half_yields, rel=1e-9)
