"""The mesh force against its map, its limits, and refused arguments."""

from dataclasses import replace

import numpy as np
import pytest
from scenes import linear_law, paper_pair, smooth_map

import fem
from exugear import MeshForce
from exugear.mesh_force.ste_interpolation import loaded_deflection
from fem import Density, PitchDeviation, Sides, pair_of, ste_map
from fem.units import mm, um


@pytest.fixture(scope="module")
def law() -> MeshForce:
    return MeshForce.from_ste(smooth_map(), damping=1000.0)


def test_static_deflection_is_the_map(law):
    ste, r_b = smooth_map(), paper_pair().pinion.r_b
    for torque in ste["torque"].values[1:-1]:
        te = ste["te"].sel(torque=torque).values
        force = law(ste["phase"].values, te) * r_b
        assert force == pytest.approx(np.full(te.size, torque), rel=1e-4)


def test_table_inverts_the_map_at_every_phase_and_load(law):
    phase = np.random.default_rng(0).random(300)
    force, deflection = loaded_deflection(smooth_map(), paper_pair().pinion.r_b, phase)
    seen = slice(20, -1)
    assert np.abs(law(phase[:, None], deflection[:, seen]) / force[seen] - 1).max() < 1e-4


def test_deflection_at_inverts_the_force(law):
    for force in (1.0, 100.0, 5000.0):
        assert law(0.37, law.deflection_at(0.37, force)) == pytest.approx(force, rel=1e-9)


def test_no_contact_no_force(law):
    assert law(0.2, [-1 * um, -1e-3, 0.0]) == pytest.approx(0, abs=0)


def test_force_is_continuous_at_loss_of_contact_even_when_parting_fast(law):
    for penetration in (1e-12, 1e-11, 1e-10):
        assert abs(law(0.2, penetration, -0.1)) < 1e9 * penetration


def test_low_loads_soften_like_a_line_contact(law):
    compliance = [law.deflection_at(0.1, force) / force for force in (0.3, 1.0, 3.0)]
    steps = -np.diff(compliance)
    assert steps[0] / steps[1] == pytest.approx(np.log(1 / 0.3) / np.log(3), rel=0.02)
    assert (steps > 0).all()


def test_back_flank_mirrors_the_driving_flank(law):
    deflection = np.linspace(1 * um, 15 * um, 7)
    back = law(law.back_phase - 0.3, -law.backlash - deflection, 0.01)
    assert back == pytest.approx(-law(0.3, deflection, -0.01))


def test_law_is_periodic(law):
    assert law(1.25, 9 * um) == pytest.approx(law(0.25, 9 * um), rel=1e-12)
    assert law(1 - 1e-12, 9 * um) == pytest.approx(law(0.0, 9 * um), rel=1e-9)


def test_force_grows_smoothly(law):
    deflection = np.linspace(0.1, 60, 4000) * um
    phase = np.full(deflection.size, 0.31)
    slope = np.diff(law(phase, deflection)) / np.diff(deflection)
    assert (slope > 0).all()
    assert slope.max() <= law.stiffness_max * 1.01
    assert np.abs(np.diff(slope)[100:]).max() < 0.01 * slope.max()


def test_damping_acts_on_the_rate_once_it_has_ramped_in(law):
    assert law(0.3, 9 * um, 0.02) - law(0.3, 9 * um, 0.0) == pytest.approx(1000 * 0.02)


def test_unloaded_error_shifts_the_contact():
    ste = smooth_map()
    wave = 2 * um * np.sin(2 * np.pi * ste["phase"].values)
    shifted = MeshForce.from_ste(
        ste_map(paper_pair(), ste["torque"].values, ste["phase"].values, ste["te"].values + wave), damping=0.0
    )
    plain = MeshForce.from_ste(ste, damping=0.0)
    assert shifted(0.25, 9 * um) == pytest.approx(plain(0.25, 7 * um), rel=1e-4)
    assert shifted(0.25, 1.9 * um) == 0


def test_jumps_between_phases_do_not_ring():
    law = linear_law((1e8, 1e8, 3e8, 3e8), (0.0, 0.4999, 0.5, 0.9999))
    force = law(np.linspace(0, 1, 20001), 10 * um)
    assert force.min() == pytest.approx(1e3, rel=1e-12)
    assert force.max() == pytest.approx(3e3, rel=1e-12)
    assert law([0.49, 0.51], 10 * um) == pytest.approx([1e3, 3e3], rel=1e-12)


@pytest.mark.parametrize("deflection", [1e-3, -0.01])
def test_beyond_the_map_is_refused(law, deflection):
    with pytest.raises(ValueError, match=r"deflection .* beyond the map, which ends at .* larger torque"):
        law(0.1, deflection)
    with pytest.raises(ValueError, match="force must lie in"):
        law.deflection_at(0.1, 1e6)


TABLE = {"phase": [0, 0.3, 0.6], "deflection": [0, 1e-5], "force_table": [[0, 1e3]] * 3}
GOOD = TABLE | {"damping": 0.0, "backlash": 1e-4}


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"damping": -1}, "damping must be >= 0"),
        ({"damping": np.nan}, "damping must be >= 0"),
        ({"backlash": -1e-6}, "backlash must be >= 0"),
        ({"backlash": 0.18}, "pass metres"),
        ({"back_phase": np.inf}, "back_phase must be finite"),
        ({"phase": [0, 0.5, 1.0]}, "phase must increase within"),
        ({"phase": [0, 120, 240]}, "phase must increase within"),
        ({"phase": [], "force_table": np.zeros((0, 2))}, "phase must increase over at least 1"),
        ({"deflection": [0, 10.0]}, "pass metres"),
        ({"deflection": [1e-5, 0]}, "deflection must increase"),
        ({"deflection": [0, np.nan]}, "deflection must increase"),
        ({"force_table": [[0, -1e3]] * 3}, "force_table must grow"),
        ({"force_table": [[0, 0]] * 3}, "force_table must grow"),
        ({"force_table": [[5, 1e3]] * 3}, "force_table must be 0 in the first column"),
        ({"force_table": [[0, np.nan]] * 3}, "force_table must be finite"),
        ({"force_table": [[0, 1, 2]] * 3}, "force_table must be"),
        ({"deflection": [-1e-3, -9e-4], "backlash": 1e-4}, "jams the teeth"),
    ],
)
def test_bad_tables_are_refused(changes, message):
    data = GOOD | changes
    table = [data.pop(name) for name in ("phase", "deflection", "force_table")]
    with pytest.raises(ValueError, match=message):
        MeshForce(*table, **data)


def test_maps_that_define_no_force_law_are_refused():
    with pytest.raises(ValueError, match="torque must start at 0"):
        MeshForce.from_ste(smooth_map((5, 50, 150)), damping=0.0)
    falling = smooth_map()
    falling["te"] = -falling["te"]
    with pytest.raises(ValueError, match="te must grow with the torque"):
        MeshForce.from_ste(falling, damping=0.0)
    with pytest.raises(ValueError, match="torque needs 0 and two loads"):
        MeshForce.from_ste(smooth_map((0, 50)), damping=0.0)


def with_flank(ste, flank):
    """The same map with the attributes of a pair whose pinion has this flank."""
    pair = pair_of(ste)
    pair = replace(pair, pinion=replace(pair.pinion, flank=flank))
    return ste_map(pair, ste["torque"].values, ste["phase"].values, ste["te"].values)


def test_a_map_that_ends_before_the_teeth_repeat_is_refused(law):
    """It would jump from its end to its beginning; deviations common to all teeth do not jump."""
    worn = PitchDeviation(np.linspace(0, 8 * um, 57))
    for make in (MeshForce.from_ste, lambda ste: MeshForce.secant(ste, 150)):
        with pytest.raises(
            ValueError, match=r"1 pitch, .* again after 57 pitches; map all .*, or map the pair without"
        ):
            make(with_flank(smooth_map(), worn))
    with pytest.raises(ValueError, match="again after 57 pitches"):
        MeshForce.from_ste(with_flank(smooth_map(), Sides(left=worn)))
    for harmless in (PitchDeviation(np.full(57, 3 * um)), Sides(right=worn)):
        same = MeshForce.from_ste(with_flank(smooth_map(), harmless), damping=1000.0)
        assert same.table.tobytes() == law.table.tobytes()


@pytest.mark.parametrize("argument", [(np.nan, 1e-6, 0.0), (0.1, np.nan, 0.0), (0.1, 1e-6, np.inf)])
def test_arguments_that_are_not_finite_are_refused(law, argument):
    with pytest.raises(ValueError, match="must be finite"):
        law(*argument)


def test_one_phase_is_a_constant_law():
    law = MeshForce([0.0], [0, 100 * um], [[0, 42e3]])
    assert law(np.linspace(0, 0.99, 7), 10 * um) == pytest.approx(4200)
    assert law.stiffness_max == pytest.approx(4.2e8)
    assert law(0.3, -5e-3) == 0


def test_a_map_of_finite_elements_has_a_law_at_all_offsets_within_its_axes():
    """Polynomials over the axial offset undershoot beside the loss of contact, where a force that pulls may rise.

    The other misalignments are mirror images.
    """
    axes = fem.Offsets(misalignment=(-4e-4, -2e-4, 0.0, 2e-4, 4e-4), axial=(-1 * mm, 0.0, 1 * mm))
    slices = fem.Slices(Density(flank=6, fillet=1, tooth=2, rim=1, body=1, width=1), 10)
    ste = fem.static_transmission_error(
        paper_pair(), [0, 5, 50, 200], 12, offsets=axes, resolution=slices, progress=False
    )
    law = MeshForce.from_ste(ste)
    for misalignment in np.linspace(0, 4e-4, 5):
        for axial in np.linspace(-1 * mm, 1 * mm, 5):
            fixed = law.at(misalignment=misalignment, axial=axial)
            assert (fixed.force_table >= 0).all()
            deflection = fixed.deflection_at(0.3, 1000.0)
            there = float(law(0.3, deflection, misalignment=misalignment, axial=axial))
            assert there == pytest.approx(1000.0, rel=2e-3)
    with pytest.raises(ValueError, match=r"deflection_at needs all of .'misalignment', 'axial'., got .'axial': 0.0"):
        law.deflection_at(0.3, 1000.0, axial=0.0)


@pytest.mark.parametrize("conserves", [False, True])
def test_an_extrapolated_law_equals_the_map_within_it_and_is_straight_beyond(conserves):
    """Within the map as exact as without, from 3e-6 of its largest force on; slope continuous."""
    ste, phase = smooth_map(), np.random.default_rng(0).random(100)
    law = MeshForce.from_ste(ste, extend=2.0, conserves=conserves)
    force, deflection = loaded_deflection(ste, paper_pair().pinion.r_b, phase)
    seen = slice(int(np.searchsorted(force, 6e-6 * 2 * force[-1])), -1)
    assert np.abs(law(phase[:, None], deflection[:, seen]) / force[seen] - 1).max() < 1.2e-4
    end = deflection[:, -1]
    top = np.array([law.unloaded(p)[1] for p in phase])
    assert law(phase, top) == pytest.approx(np.full(100, 2 * force[-1]), rel=1e-5)
    middle = (top + end) / 2
    before, after, beyond = (slope(law, phase, *x) for x in ((0.9999 * end, end), (end, 1.0001 * end), (middle, top)))
    assert before == pytest.approx(after, rel=1e-3)
    assert after == pytest.approx(beyond, rel=1e-2)
    assert slope(law, phase, end, middle) == pytest.approx(beyond, rel=1e-3)


def slope(law, phase, start, end) -> np.ndarray:
    """Of the force between two deflections."""
    return (law(phase, end) - law(phase, start)) / (end - start)
