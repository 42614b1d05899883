"""Fields: balance at the hub, Hertz, work, mirror, files."""

import sys
from dataclasses import replace
from pathlib import Path

import meshio
import numpy as np
import pytest
from loaded_gears import GEAR, ROUGH, helical, hertz_load
from paper_gears import few_teeth, paper_pair

import fem
from fem.elasticity import section_mesh
from fem.elasticity.mesh_density import Density
from fem.pair.placement import Placement, placements
from fem.stress import fields as stress
from fem.stress import flank_loads, gear_elasticity, stress_recovery
from fem.stress.flank_loads import FlankLoad
from fem.stress.gear_elasticity import Body
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
def plane_fixture() -> Body:
    return gear_elasticity.plane_body(GEAR, gear_elasticity.graded(GEAR, COARSE, TWO_TEETH, 1 / 3))


@pytest.fixture(scope="module", name="bodies")
def bodies_fixture(plane) -> dict[str, Body]:
    return {
        "plane": plane,
        "solid": gear_elasticity.solid_body(GEAR, TINY),
        "helical": gear_elasticity.solid_body(helical(), TINY),
    }


@pytest.mark.parametrize("level", ["plane", "solid", "helical"])
def test_the_hub_carries_force_moment_and_thrust(level, bodies):
    """With F the transverse force: moment F r_b, axial force F tan(beta_b).

    Across the axis of a helical gear to 2e-5: displaced as a whole, it moves on no polynomial along axes that turn.
    """
    body, on_teeth = bodies[level], TWO_TEETH if level == "plane" else [in_slices(load) for load in TWO_TEETH]
    gear, forces = body.gear, gear_elasticity.forces(body, on_teeth)
    hub = body.in_fixed_axes(body.stiffness.matrix @ body.displacement(forces) - forces)
    applied, total = body.in_fixed_axes(forces), sum(load.force.sum() for load in on_teeth)
    assert hub.sum(axis=1) == pytest.approx(-applied.sum(axis=1), abs=(2e-5 if gear.beta else 1e-9) * total)
    corners = np.repeat(body.section.doflocs, body.axial.size, axis=1)
    x, y = section_mesh.rotated(corners, body.gear.twist * np.tile(body.axial, body.section.N))
    moment, transverse = x @ applied[1] - y @ applied[0], total * np.cos(gear.beta_b)
    assert x @ hub[1] - y @ hub[0] == pytest.approx(-moment, rel=1e-9)
    assert moment == pytest.approx(-gear.r_b * transverse, rel=1e-5 if level == "plane" else 3e-3)
    away = np.hypot(x, y) > gear.d_bore / 2 * 1.001
    assert np.abs(hub[:, away]).max() < 1e-8 * total
    if level != "plane":
        assert hub[2].sum() == pytest.approx(-transverse * np.tan(gear.beta_b), rel=1e-9, abs=1e-9 * total)
        across = sum(load.force.sum(axis=1) @ (load.low + load.high) / 2 for load in on_teeth)
        assert np.hypot(*(np.tile(body.axial, body.section.N) @ forces.reshape(3, -1)[:2].T)) == pytest.approx(
            across * np.cos(gear.beta_b), rel=5e-3
        )


ANY = [[1e-3, 2e-4, 0], [0, -3e-4, 5e-4], [0, 0, 2e-4]]
ROUND = np.diag([1e-3, 1e-3, 2e-4])


@pytest.mark.parametrize(
    ("level", "rate", "error"),
    [("plane", ANY, 1e-8), ("solid", ANY, 1e-8), ("helical", ROUND, 1e-8), ("helical", ANY, 1e-4)],
)
def test_uniform_strain_gives_uniform_stress(level, rate, error, bodies):
    """Along axes that turn it is no polynomial unless it is alike in all directions of the section."""
    body, rate = bodies[level], np.array(rate)
    dim = body.dim
    strain = ((rate + rate.T) / 2)[:dim, :dim]
    places = np.stack([*np.repeat(body.section.doflocs, body.axial.size, axis=1), np.tile(body.axial, body.section.N)])
    places[:2] = section_mesh.rotated(places[:2], body.gear.twist * places[2])
    moved = (rate[:dim, :dim] @ places[:dim]).reshape(dim, -1, body.axial.size)
    moved[:2] = section_mesh.rotated(moved[:2], -body.gear.twist * body.axial)
    lame, mu = 210e9 * 0.3 / 1.3 / 0.4, 210e9 / 2.6
    expected = np.zeros((3, 3))
    expected[:dim, :dim] = 2 * mu * strain
    expected += lame * np.trace(strain) * np.eye(3)
    found = stress_recovery.stress(body, moved.ravel())
    assert np.abs(found - expected[..., None]).max() < error * expected.max()


def test_von_mises_of_tension_and_shear():
    tension, shear = np.diag([5.0, 0, 0]), np.array([[0, 2.0, 0], [2, 0, 0], [0, 0, 0]])
    assert stress.von_mises(np.stack([tension, shear], axis=2)) == pytest.approx([5, 2 * np.sqrt(3)])


def test_stress_under_a_small_contact_is_that_of_a_half_plane():
    """Von Mises 0.5575 p0 at depth 0.70 a (Johnson, Contact Mechanics, 4.2: line contact, nu 0.3)."""
    load, half, peak = hertz_load(93.65e3 / 400)
    body = gear_elasticity.plane_body(GEAR, gear_elasticity.graded(GEAR, COARSE, [load], 1 / 6))
    equivalent = stress.von_mises(stress_recovery.stress(body, body.displacement(gear_elasticity.forces(body, [load]))))
    middle = load.extent[:1]
    depth = flank_loads.push(GEAR, 0, middle)[:2, 0] @ (body.mesh.p - flank_loads.flank_points(GEAR, 0, middle))
    worst = np.argmax(equivalent)
    assert equivalent[worst] / peak == pytest.approx(0.5575, rel=0.01)
    assert depth[worst] / half == pytest.approx(0.70, abs=0.07)


@pytest.mark.parametrize("level", ["plane", "helical"])
def test_work_of_one_load_on_the_way_of_another_is_mutual(level, bodies):
    body = bodies[level]
    one, other = (gear_elasticity.forces(body, [load if level == "plane" else in_slices(load)]) for load in TWO_TEETH)
    work = one @ body.displacement(other)
    assert other @ body.displacement(one) == pytest.approx(work, rel=1e-9)
    assert abs(work) < np.sqrt((one @ body.displacement(one)) * (other @ body.displacement(other)))


@pytest.fixture(scope="module", name="one_pair")
def one_pair_fixture():
    return stress.plane_fields(paper_pair(), 150.0, 0.0, density=COARSE, refine=4, resolution=ROUGH)


def test_pressure_is_hertzian(one_pair):
    (encounter,), _ = flank_loads.encounters(paper_pair(), [0.0], None, ROUGH)
    state = encounter.state(150.0 / GEAR.r_b)
    _, _, peak = hertz_load(state.line_load())
    for field in one_pair:
        assert field.pressure.max() == pytest.approx(peak, rel=0.01)


def test_pressed_flanks_touch(one_pair):
    """The gap that 9 um of transmission error close is closed by displacement, in plane strain to 2 % of that."""
    pair = paper_pair()
    along = np.array([np.sin(pair.alpha_wt), np.cos(pair.alpha_wt)])
    flanks = []
    for field in one_pair:
        pressed = field.pressure > 0.3 * field.pressure.max()
        deformed = (field.points + field.displacement)[:, pressed]
        order = np.argsort(deformed[0])
        flanks.append(np.stack([np.array([along[1], -along[0]]) @ deformed, along @ deformed])[:, order])
    (at, pinion), (other, wheel) = flanks
    inside = (at > other.min()) & (at < other.max())
    gap = np.interp(at[inside], other, wheel) - pinion[inside]
    assert np.ptp(gap) < 0.05 * um
    assert np.abs(gap).max() < 0.02 * 9.12 * um
    assert one_pair[0].deformed(1.0) == pytest.approx(one_pair[0].points + one_pair[0].displacement)


def test_flank_may_begin_on_the_base_circle():
    """As with few teeth whose fillet is given; a smaller one than the rack's bears more."""
    pairs = [fem.GearPair(gear, gear) for gear in (few_teeth(fillet=0.5 * mm), few_teeth())]
    assert pairs[0].pinion.roll_form == 0
    options = {"density": COARSE, "refine": 4, "resolution": ROUGH}
    (sharp, _), (rack, _) = (stress.plane_fields(pair, 30.0, 0.0, **options) for pair in pairs)
    assert sharp.pressure.max() == pytest.approx(rack.pressure.max(), rel=0.02)
    assert rack.root_stress < sharp.root_stress < 1.5 * rack.root_stress


@pytest.mark.parametrize("offsets", [fem.Offsets(misalignment=2e-4), fem.Offsets(a=150.2 * mm, axial=3 * mm)])
@pytest.mark.parametrize("hand", [0, 1])
def test_loads_of_a_contact_balance_the_torque(hand, offsets):
    """Torque over r_b is the transverse force; both gears bear the same, at the same place of the common face."""
    pair = paper_pair() if hand == 0 else fem.GearPair(helical(), helical(-1), a=149.5 * mm)
    offsets = replace(offsets, a=None) if hand else offsets
    (encounter,), misalignment = flank_loads.encounters(pair, [0.3], offsets, ROUGH)
    on_gears = flank_loads.flank_loads(encounter, encounter.state(150 / pair.pinion.r_b, misalignment))
    centroids = []
    for on_teeth, shift in zip(on_gears, (0.0, encounter.meeting.axial), strict=True):
        force = np.concatenate([load.force.sum(axis=1) for load in on_teeth])
        middle = np.concatenate([(load.low + load.high) / 2 for load in on_teeth])
        assert force.sum() * np.cos(pair.beta_b) == pytest.approx(150 / pair.pinion.r_b, rel=2e-3)
        centroids.append(force @ middle / force.sum() + shift)
    assert centroids[0] == pytest.approx(centroids[1], abs=1e-9)
    assert abs(centroids[0]) > 0.1 * mm


@pytest.mark.parametrize("phase", [0.125, 0.875])
def test_force_on_a_tips_corner_is_on_the_flank(phase):
    """Several strips of the mate lie at its tip, where only a corner is left to press."""
    gear = fem.Gear(z=30, m_n=2 * mm, x=0.5, b=10 * mm, d_bore=30 * mm)
    pair = fem.GearPair(gear, gear)
    (encounter,), _ = flank_loads.encounters(pair, [phase], None, None)
    state = encounter.state(150 / gear.r_b)
    tip, pressed = flank_loads.flank_ends(gear)[1], state.load > 0
    assert ((state.strips.arcs >= tip * (1 - 1e-9)) & pressed).sum(axis=(1, 2)).max() > 1
    pinion, wheel = (sum(load.force.sum() for load in side) for side in flank_loads.flank_loads(encounter, state))
    assert pinion == pytest.approx(wheel, rel=1e-12)
    assert pinion == pytest.approx(150 / gear.r_b, rel=5e-3)


@pytest.mark.parametrize("phase", [0.2, 0.8])
def test_corner_presses_both_gears_alike(phase):
    """The largest pressure of the map, which a corner puts on one strip, is on both gears, in plane and in space."""
    options = {"density": COARSE, "resolution": ROUGH}
    peak = fem.static_transmission_error(paper_pair(), 350, [phase], resolution=ROUGH, progress=False)["peak_pressure"]
    for fields in (stress.plane_fields, stress.solid_fields):
        for field in fields(paper_pair(), 350.0, phase, **options):
            assert field.pressure.max() == pytest.approx(peak.item(), rel=0.005)
    assert peak > 2500 * MPa


def strip_middles(placement: Placement, on_teeth: list[FlankLoad]) -> np.ndarray:
    """(3, n) middles of all strips that carry load, where the gear stands; in order of z and y."""
    points = []
    for load in on_teeth:
        axial = np.broadcast_to((load.low + load.high)[:, None] / 2, load.force.shape)
        gear, turn = placement.gear, placement.rotation + placement.gear.twist * axial
        x, y = section_mesh.rotated(flank_loads.flank_points(gear, load.tooth, load.middle), turn)
        points.append(np.stack([x, y, axial])[:, load.force > 0] + placement.centre[:, None])
    x, y, z = np.hstack(points)
    return np.stack([x, y, z])[:, np.lexsort((y, np.round(z / um)))]


@pytest.mark.parametrize("hand", [0, 1, -1])
def test_strips_of_both_gears_meet_where_the_gears_stand(hand):
    """They overlap by the transmission error, which deflection makes room for; 1.07 of it along with half a strip."""
    pair = paper_pair() if hand == 0 else fem.GearPair(helical(hand), helical(-hand))
    offsets = fem.Offsets(a=pair.a + 0.1 * mm, axial=2 * mm)
    (encounter,), _ = flank_loads.encounters(pair, [0.3], offsets, ROUGH)
    state = encounter.state(150 / pair.pinion.r_b)
    placed, on_gears = placements(encounter.meeting, state.te), flank_loads.flank_loads(encounter, state)
    pinion, wheel = (strip_middles(*gear) for gear in zip(placed, on_gears, strict=True))
    overlap = np.linalg.norm(pinion - wheel, axis=0)
    assert 0.8 * state.te < overlap.min() and overlap.max() < 1.15 * state.te


def test_halves_that_are_alike_are_both_loaded():
    (encounter,), _ = flank_loads.encounters(paper_pair(), [0.0], None, ROUGH)
    (load,), _ = flank_loads.flank_loads(encounter, encounter.state(150 / GEAR.r_b))
    assert load.force.sum() == pytest.approx(150 / GEAR.r_b, rel=1e-3)
    assert load.low == pytest.approx(-load.high[::-1]) and load.low[0] == pytest.approx(-GEAR.b / 2)
    assert (load.force == load.force[::-1]).all() and load.low[1:] == pytest.approx(load.high[:-1])


@pytest.fixture(scope="module", name="two_pairs")
def two_pairs_fixture():
    return [
        stress.plane_fields(paper_pair(), 150.0, phase, density=COARSE, refine=4, resolution=ROUGH)
        for phase in (0.4, 0.6)
    ]


def test_swapped_gears_mirror_the_fields(two_pairs):
    """What the pinion is at one phase, an equal wheel is as far on the other side of the pitch point, turned by pi.

    To 0.1 %: the same flank is another tooth of the mesh, of which only some pitches have teeth.
    """
    before, after = two_pairs
    for pinion, wheel in ((before[0], after[1]), (after[0], before[1])):
        for name in ("von_mises", "pressure"):
            one, other = getattr(pinion, name), getattr(wheel, name)
            assert other.max() == pytest.approx(one.max(), rel=1e-3)
            places = pinion.points[:, np.argmax(one)], wheel.points[:, np.argmax(other)]
            assert sum(places) == pytest.approx([paper_pair().a, 0], abs=0.01 * mm)
        assert wheel.root_stress == pytest.approx(pinion.root_stress, rel=1e-3)
        tips = (np.hypot(*field.displacement).max() for field in (pinion, wheel))
        assert next(tips) == pytest.approx(next(tips), rel=1e-3)


@pytest.fixture(scope="module", name="solids")
def solids_fixture():
    return stress.solid_fields(paper_pair(), 150.0, 0.0, density=replace(COARSE, width=1), resolution=ROUGH)


def test_solid_bends_like_the_section(solids, one_pair):
    """The middle of the width is nearly in plane strain."""
    for solid, section in zip(solids, one_pair, strict=True):
        assert solid.root_stress == pytest.approx(section.root_stress, rel=0.03)
        largest = np.hypot(*solid.displacement[:2]).max()
        assert largest == pytest.approx(np.hypot(*section.displacement).max(), rel=0.01)
        lower, upper = (solid.von_mises[np.isclose(solid.points[2], z)].max() for z in (-11.5 * mm, 11.5 * mm))
        assert lower == pytest.approx(upper, rel=1e-6)


@pytest.fixture(scope="module", name="hands")
def hands_fixture():
    pairs = [fem.GearPair(helical(hand), helical(-hand)) for hand in (1, -1)]
    return [stress.solid_fields(pair, 150.0, 0.2, density=TINY, resolution=ROUGH) for pair in pairs]


def test_other_hand_mirrors_the_fields(hands):
    for one, other in zip(*hands, strict=True):
        mirrored = np.array([[1.0], [1.0], [-1.0]])
        order, back = (np.lexsort(np.round(p / um)) for p in (one.points, other.points * mirrored))
        assert (other.points * mirrored)[:, back] == pytest.approx(one.points[:, order], abs=1e-9)
        assert other.von_mises[back] == pytest.approx(one.von_mises[order], rel=1e-5, abs=1e3)
        moved = (other.displacement * mirrored)[:, back]
        assert moved == pytest.approx(one.displacement[:, order], abs=1e-5 * np.abs(moved).max())


@pytest.mark.parametrize("level", ["one_pair", "solids"])
def test_files_give_the_same_arrays_back(level, request, tmp_path):
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
def test_pressure_of_every_strip_shows_at_the_point_next_to_it(level, bodies):
    """However small it is against an element; nowhere else on the flanks."""
    body, low, high = bodies[level], np.array([-9.0, -2.0]) * mm, np.array([-2.0, 2.0]) * mm
    arcs = np.add.outer([0.0, 1 * mm], hertz_load(93e3)[0].edges[0])
    load = FlankLoad(0, arcs, low, high, np.add.outer([85.0, 60.0], np.arange(12.0)))
    load = load.section(-3 * mm) if level == "plane" else load
    pressure = gear_elasticity.contact_pressure(body, [load]).reshape(-1, body.axial.size)
    strips = load.force / np.diff(load.edges) / (load.high - load.low)[:, None] * np.cos(body.gear.beta_b)
    assert pressure.max() == pytest.approx(strips.max(), rel=1e-12)
    facets = body.section.mesh.facets[:, flank_loads.outline(body.gear, body.section.mesh, 0)[0]]
    ends = flank_loads.arcs_of(body.gear, body.section.mesh.p[:, facets])
    far = np.abs(ends[:, :, None] - load.middle.ravel()).min(axis=2) > np.abs(ends[1] - ends[0]).max()
    assert far.any() and not pressure[facets[far]].any()
    assert level == "plane" or not pressure[:, np.abs(body.line.p[0] + 3.5 * mm) > 9 * mm].any()


def test_contacts_like_the_papers_figure(one_pair, two_pairs):
    two = two_pairs[0]
    assert len(korta_fields.contacts(one_pair[0])) == 1 and len(korta_fields.contacts(two[0])) == 2
    assert two[0].root_stress == pytest.approx(70 * MPa, rel=0.05)


@pytest.mark.slow
def test_figure_like_the_papers(one_pair, two_pairs, tmp_path):
    korta_fields.draw_fields({"one": one_pair, "two": two_pairs[0]}, tmp_path / "fields.png")
    assert (tmp_path / "fields.png").stat().st_size > 100_000


@pytest.mark.parametrize(
    ("changes", "told"),
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
        ({"pair": fem.GearPair(helical(), helical(-1))}, "take solid_fields"),
    ],
)
def test_bad_input_is_refused(changes, told):
    with pytest.raises(ValueError, match=told):
        stress.plane_fields(**{"pair": paper_pair(), "torque": 150.0, "phase": 0.0} | changes)


def test_bad_loads_and_files_are_refused(one_pair, plane, tmp_path):
    with pytest.raises(ValueError, match=r"\.vtu"):
        stress.save_vtu(one_pair, tmp_path / "pair.png")
    for fields in (one_pair[0], (), None):
        with pytest.raises(ValueError, match="fields must be"):
            stress.save_vtu(fields, tmp_path / "pair.vtu")
    zero, one = np.zeros(1), np.ones(1)
    with pytest.raises(ValueError, match="shape"):
        FlankLoad(0, np.array([[0.0, 1]]), zero, one, np.zeros((2, 2)))
    with pytest.raises(ValueError, match="increase"):
        FlankLoad(0, np.array([[1.0, 0]]), zero, one, np.zeros((1, 1)))
    with pytest.raises(ValueError, match="not on the mesh"):
        gear_elasticity.forces(plane, [hertz_load(1.0, 7)[0]])
