"""Fields: balance at the hub, Hertz, work, mirror, files."""

import sys
from dataclasses import replace
from pathlib import Path

import meshio
import numpy as np
import pytest
from loaded_gears import GEAR, ROUGH, helical_gear, hertz_load
from paper_gears import few_teeth, paper_pair

import fem
from fem.elasticity import section_mesh
from fem.elasticity.mesh_density import Density
from fem.gear.tooth_profile import arc_at, flank_points
from fem.pair.placement import Placement, placements
from fem.stress import fields as stress
from fem.stress import flank_loads, gear_elasticity, stress_recovery, tooth_boundary
from fem.stress.flank_loads import FlankLoad
from fem.stress.gear_elasticity import ElasticGear
from fem.units import MPa, mm, um

sys.path.insert(0, str(Path(__file__).parents[3] / "examples"))
import korta_fields

TINY = Density(flank=4, fillet=1, tooth=2, rim=1, body=1, teeth=1, width=2)
COARSE = Density(flank=8, fillet=2, tooth=2, rim=2, body=3, width=2)


def in_slices(load: FlankLoad) -> FlankLoad:
    """Three slices with different loads."""
    share, edges = np.array([[1.0], [3.0], [2.0]]) * mm, np.array([-5, -2, 1, 7]) * mm
    return FlankLoad(load.tooth, np.tile(load.edges, (3, 1)), edges[:-1], edges[1:], share * load.force)


TWO_TEETH = [hertz_load(93e3, 0)[0], hertz_load(50e3, 1)[0]]


@pytest.fixture(scope="module", name="plane")
def plane_fixture() -> ElasticGear:
    return gear_elasticity.plane_gear(GEAR, gear_elasticity.section_refined_at(GEAR, COARSE, TWO_TEETH, 1 / 3))


@pytest.fixture(scope="module", name="elastic_gears")
def elastic_gears_fixture(plane) -> dict[str, ElasticGear]:
    return {
        "plane": plane,
        "solid": gear_elasticity.solid_gear(GEAR, TINY),
        "helical": gear_elasticity.solid_gear(helical_gear(), TINY),
    }


@pytest.mark.parametrize("level", ["plane", "solid", "helical"])
def test_the_hub_carries_force_moment_and_thrust(level, elastic_gears):
    """With F the transverse force: moment F r_b, axial force F tan(beta_b).

    Transverse forces of a helical gear to 2e-5: a rigid translation is no polynomial along axes that turn.
    """
    elastic, on_teeth = elastic_gears[level], TWO_TEETH if level == "plane" else [in_slices(load) for load in TWO_TEETH]
    gear, forces = elastic.gear, gear_elasticity.nodal_forces(elastic, on_teeth)
    hub = elastic.in_fixed_axes(elastic.stiffness.matrix @ elastic.displacement(forces) - forces)
    applied, total = elastic.in_fixed_axes(forces), sum(load.force.sum() for load in on_teeth)
    assert hub.sum(axis=1) == pytest.approx(-applied.sum(axis=1), abs=(2e-5 if gear.beta else 1e-9) * total)
    corners = np.repeat(elastic.section.doflocs, elastic.axial.size, axis=1)
    x, y = section_mesh.rotated(corners, elastic.gear.twist * np.tile(elastic.axial, elastic.section.N))
    moment, transverse = x @ applied[1] - y @ applied[0], total * np.cos(gear.beta_b)
    assert x @ hub[1] - y @ hub[0] == pytest.approx(-moment, rel=1e-9)
    assert moment == pytest.approx(-gear.r_b * transverse, rel=1e-5 if level == "plane" else 3e-3)
    away = np.hypot(x, y) > gear.d_bore / 2 * 1.001
    assert np.abs(hub[:, away]).max() < 1e-8 * total
    if level != "plane":
        assert hub[2].sum() == pytest.approx(-transverse * np.tan(gear.beta_b), rel=1e-9, abs=1e-9 * total)
        across = sum(load.force.sum(axis=1) @ (load.low + load.high) / 2 for load in on_teeth)
        assert np.hypot(*(np.tile(elastic.axial, elastic.section.N) @ forces.reshape(3, -1)[:2].T)) == pytest.approx(
            across * np.cos(gear.beta_b), rel=5e-3
        )


GENERAL_STRAIN = [[1e-3, 2e-4, 0], [0, -3e-4, 5e-4], [0, 0, 2e-4]]
ISOTROPIC_STRAIN = np.diag([1e-3, 1e-3, 2e-4])


@pytest.mark.parametrize(
    ("level", "rate", "error"),
    [
        ("plane", GENERAL_STRAIN, 1e-8),
        ("solid", GENERAL_STRAIN, 1e-8),
        ("helical", ISOTROPIC_STRAIN, 1e-8),
        ("helical", GENERAL_STRAIN, 1e-4),
    ],
)
def test_uniform_strain_gives_uniform_stress(level, rate, error, elastic_gears):
    """Along axes that turn it is no polynomial unless it is isotropic in the section."""
    elastic, rate = elastic_gears[level], np.array(rate)
    dim = elastic.dim
    strain = ((rate + rate.T) / 2)[:dim, :dim]
    points = np.stack(
        [*np.repeat(elastic.section.doflocs, elastic.axial.size, axis=1), np.tile(elastic.axial, elastic.section.N)]
    )
    points[:2] = section_mesh.rotated(points[:2], elastic.gear.twist * points[2])
    u = (rate[:dim, :dim] @ points[:dim]).reshape(dim, -1, elastic.axial.size)
    u[:2] = section_mesh.rotated(u[:2], -elastic.gear.twist * elastic.axial)
    lame, mu = 210e9 * 0.3 / 1.3 / 0.4, 210e9 / 2.6
    expected = np.zeros((3, 3))
    expected[:dim, :dim] = 2 * mu * strain
    expected += lame * np.trace(strain) * np.eye(3)
    recovered = stress_recovery.stress(elastic, u.ravel())
    assert np.abs(recovered - expected[..., None]).max() < error * expected.max()


def test_von_mises_of_tension_and_shear():
    tension, shear = np.diag([5.0, 0, 0]), np.array([[0, 2.0, 0], [2, 0, 0], [0, 0, 0]])
    assert stress.von_mises(np.stack([tension, shear], axis=2)) == pytest.approx([5, 2 * np.sqrt(3)])


def test_stress_under_a_small_contact_is_that_of_a_half_plane():
    """Von Mises 0.5575 p0 at depth 0.70 a (Johnson, Contact Mechanics, 4.2: line contact, nu 0.3)."""
    load, half, peak = hertz_load(93.65e3 / 400)
    elastic = gear_elasticity.plane_gear(GEAR, gear_elasticity.section_refined_at(GEAR, COARSE, [load], 1 / 6))
    u = elastic.displacement(gear_elasticity.nodal_forces(elastic, [load]))
    equivalent = stress.von_mises(stress_recovery.stress(elastic, u))
    middle = load.extent[:1]
    depth = tooth_boundary.inward_normal(GEAR, 0, middle)[:2, 0] @ (elastic.mesh.p - flank_points(GEAR, middle))
    highest = np.argmax(equivalent)
    assert equivalent[highest] / peak == pytest.approx(0.5575, rel=0.01)
    assert depth[highest] / half == pytest.approx(0.70, abs=0.07)


@pytest.mark.parametrize("level", ["plane", "helical"])
def test_displacements_of_two_loads_are_reciprocal(level, elastic_gears):
    """Betti: the work of each load on the displacement of the other load is the same."""
    elastic = elastic_gears[level]
    loads = (load if level == "plane" else in_slices(load) for load in TWO_TEETH)
    first, second = (gear_elasticity.nodal_forces(elastic, [load]) for load in loads)
    work = first @ elastic.displacement(second)
    assert second @ elastic.displacement(first) == pytest.approx(work, rel=1e-9)
    assert abs(work) < np.sqrt((first @ elastic.displacement(first)) * (second @ elastic.displacement(second)))


@pytest.fixture(scope="module", name="single_contact")
def single_contact_fixture():
    return stress.plane_fields(paper_pair(), 150.0, 0.0, density=COARSE, refine=4, resolution=ROUGH)


def test_pressure_is_hertzian(single_contact):
    (contact,), _ = flank_loads.tooth_contacts(paper_pair(), [0.0], None, ROUGH)
    state = contact.state(150.0 / GEAR.r_b)
    _, _, peak = hertz_load(state.line_load())
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


@pytest.mark.parametrize("offsets", [fem.Offsets(misalignment=2e-4), fem.Offsets(a=150.2 * mm, axial=3 * mm)])
@pytest.mark.parametrize("hand", [0, 1])
def test_loads_of_a_contact_balance_the_torque(hand, offsets):
    """Torque over r_b is the transverse force; its centroid on the common face is the same for both gears."""
    pair = paper_pair() if hand == 0 else fem.GearPair(helical_gear(), helical_gear(-1), a=149.5 * mm)
    offsets = replace(offsets, a=None) if hand else offsets
    (contact,), misalignment = flank_loads.tooth_contacts(pair, [0.3], offsets, ROUGH)
    on_gears = flank_loads.flank_loads(contact, contact.state(150 / pair.pinion.r_b, misalignment))
    centroids = []
    for on_teeth, shift in zip(on_gears, (0.0, contact.position.axial), strict=True):
        force = np.concatenate([load.force.sum(axis=1) for load in on_teeth])
        middle = np.concatenate([(load.low + load.high) / 2 for load in on_teeth])
        assert force.sum() * np.cos(pair.beta_b) == pytest.approx(150 / pair.pinion.r_b, rel=2e-3)
        centroids.append(force @ middle / force.sum() + shift)
    assert centroids[0] == pytest.approx(centroids[1], abs=1e-9)
    assert abs(centroids[0]) > 0.1 * mm


@pytest.mark.parametrize("phase", [0.125, 0.875])
def test_force_on_a_tips_corner_is_on_the_flank(phase):
    """Several strips of the mating flank lie at its tip, where only the corner touches."""
    gear = fem.Gear(z=30, m_n=2 * mm, x=0.5, b=10 * mm, d_bore=30 * mm)
    pair = fem.GearPair(gear, gear)
    (contact,), _ = flank_loads.tooth_contacts(pair, [phase], None, None)
    state = contact.state(150 / gear.r_b)
    tip, pressed = tooth_boundary.flank_ends(gear)[1], state.strip_force > 0
    assert ((state.strips.arcs >= tip * (1 - 1e-9)) & pressed).sum(axis=(1, 2)).max() > 1
    pinion, wheel = (sum(load.force.sum() for load in side) for side in flank_loads.flank_loads(contact, state))
    assert pinion == pytest.approx(wheel, rel=1e-12)
    assert pinion == pytest.approx(150 / gear.r_b, rel=5e-3)


@pytest.mark.parametrize("phase", [0.2, 0.8])
def test_pressure_of_a_corner_is_equal_on_both_gears(phase):
    """The largest pressure of the map, of a corner on a single strip, is on both gears, in plane and in space."""
    options = {"density": COARSE, "resolution": ROUGH}
    peak = fem.static_transmission_error(paper_pair(), 350, [phase], resolution=ROUGH, progress=False)["peak_pressure"]
    for fields in (stress.plane_fields, stress.solid_fields):
        for field in fields(paper_pair(), 350.0, phase, **options):
            assert field.pressure.max() == pytest.approx(peak.item(), rel=0.005)
    assert peak > 2500 * MPa


def strip_middles(placement: Placement, on_teeth: list[FlankLoad]) -> np.ndarray:
    """(3, n) middles of all strips that carry load, in the position of the gear; in order of z and y."""
    points = []
    for load in on_teeth:
        axial = np.broadcast_to((load.low + load.high)[:, None] / 2, load.force.shape)
        gear, turn = placement.gear, placement.rotation + placement.gear.twist * axial
        x, y = section_mesh.rotated(flank_points(gear, load.middle, load.tooth), turn)
        points.append(np.stack([x, y, axial])[:, load.force > 0] + placement.centre[:, None])
    x, y, z = np.hstack(points)
    return np.stack([x, y, z])[:, np.lexsort((y, np.round(z / um)))]


@pytest.mark.parametrize("hand", [0, 1, -1])
def test_strips_of_both_gears_meet_where_the_gears_stand(hand):
    """They overlap by the transmission error, which the deflection compensates; with half a strip by 1.07 of it."""
    pair = paper_pair() if hand == 0 else fem.GearPair(helical_gear(hand), helical_gear(-hand))
    offsets = fem.Offsets(a=pair.a + 0.1 * mm, axial=2 * mm)
    (contact,), _ = flank_loads.tooth_contacts(pair, [0.3], offsets, ROUGH)
    state = contact.state(150 / pair.pinion.r_b)
    placed, on_gears = placements(contact.position, state.te), flank_loads.flank_loads(contact, state)
    pinion, wheel = (strip_middles(*gear) for gear in zip(placed, on_gears, strict=True))
    overlap = np.linalg.norm(pinion - wheel, axis=0)
    assert 0.8 * state.te < overlap.min() and overlap.max() < 1.15 * state.te


def test_symmetric_halves_are_equally_loaded():
    (contact,), _ = flank_loads.tooth_contacts(paper_pair(), [0.0], None, ROUGH)
    (load,), _ = flank_loads.flank_loads(contact, contact.state(150 / GEAR.r_b))
    assert load.force.sum() == pytest.approx(150 / GEAR.r_b, rel=1e-3)
    assert load.low == pytest.approx(-load.high[::-1]) and load.low[0] == pytest.approx(-GEAR.b / 2)
    assert (load.force == load.force[::-1]).all() and load.low[1:] == pytest.approx(load.high[:-1])


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


@pytest.mark.parametrize("level", ["plane", "solid", "helical"])
def test_pressure_of_every_strip_appears_at_the_nearest_point(level, elastic_gears):
    """However small the strip is against an element; and nowhere else on the flanks."""
    elastic, low, high = elastic_gears[level], np.array([-9.0, -2.0]) * mm, np.array([-2.0, 2.0]) * mm
    arcs = np.add.outer([0.0, 1 * mm], hertz_load(93e3)[0].edges[0])
    load = FlankLoad(0, arcs, low, high, np.add.outer([85.0, 60.0], np.arange(12.0)))
    load = load.section(-3 * mm) if level == "plane" else load
    pressure = gear_elasticity.contact_pressure(elastic, [load]).reshape(-1, elastic.axial.size)
    strips = load.force / np.diff(load.edges) / (load.high - load.low)[:, None] * np.cos(elastic.gear.beta_b)
    assert pressure.max() == pytest.approx(strips.max(), rel=1e-12)
    facets = elastic.section.mesh.facets[:, tooth_boundary.outline(elastic.gear, elastic.section.mesh, 0)[0]]
    ends = arc_at(elastic.gear, elastic.section.mesh.p[:, facets])
    far = np.abs(ends[:, :, None] - load.middle.ravel()).min(axis=2) > np.abs(ends[1] - ends[0]).max()
    assert far.any() and not pressure[facets[far]].any()
    assert level == "plane" or not pressure[:, np.abs(elastic.axial_mesh.p[0] + 3.5 * mm) > 9 * mm].any()


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
        ({"phase": np.nan}, "phases must increase"),
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


def test_bad_loads_and_files_are_refused(single_contact, plane, tmp_path):
    with pytest.raises(ValueError, match=r"\.vtu"):
        stress.save_vtu(single_contact, tmp_path / "pair.png")
    for fields in (single_contact[0], (), None):
        with pytest.raises(ValueError, match="fields must be"):
            stress.save_vtu(fields, tmp_path / "pair.vtu")
    low, high = np.zeros(1), np.ones(1)
    with pytest.raises(ValueError, match="shape"):
        FlankLoad(0, np.array([[0.0, 1]]), low, high, np.zeros((2, 2)))
    with pytest.raises(ValueError, match="increase"):
        FlankLoad(0, np.array([[1.0, 0]]), low, high, np.zeros((1, 1)))
    with pytest.raises(ValueError, match="not on the mesh"):
        gear_elasticity.nodal_forces(plane, [hertz_load(1.0, 7)[0]])
