"""Elastic gears under given loads: balance at the hub, exact strains, half-plane, reciprocity, refused loads."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from involutes import flank_points, turned
from loaded_gears import (
    GEAR,
    helical_gear,
    hertz_load,
    in_slices,
    load_on,
    section_around_loads,
    stress_under,
)

from fem import Density
from fem.stress import tooth_boundary
from fem.stress.fields import von_mises
from fem.stress.gear_elasticity import contact_pressure, nodal_forces, solid_gear
from fem.stress.stress_recovery import stress
from fem.units import mm

sys.path.insert(0, str(Path(__file__).parents[3] / "examples"))


TINY = Density(flank=4, fillet=1, tooth=2, rim=1, body=1, teeth=1, width=2)
COARSE = Density(flank=8, fillet=2, tooth=2, rim=2, body=3, width=2)


def in_three_slices(load):
    """Slices with different loads."""
    edges = np.array([-5, -2, 1, 7]) * mm
    return in_slices(load, edges[:-1], edges[1:], np.array([1, 3, 2]) * mm)


TWO_TEETH = [hertz_load(93e3, 0)[0], hertz_load(50e3, 1)[0]]


@pytest.fixture(scope="module", name="plane")
def plane_fixture():
    return section_around_loads(GEAR, COARSE, TWO_TEETH, 1 / 3)


@pytest.fixture(scope="module", name="elastic_gears")
def elastic_gears_fixture(plane):
    return {
        "plane": plane,
        "solid": solid_gear(GEAR, TINY),
        "helical": solid_gear(helical_gear(), TINY),
    }


@pytest.mark.parametrize("level", ["plane", "solid", "helical"])
def test_the_hub_carries_force_moment_and_thrust(level, elastic_gears):
    """With F the transverse force: moment F r_b, axial force F tan(beta_b).

    Transverse forces of a helical gear to 2e-5: a rigid translation is no polynomial along axes that turn.
    """
    elastic = elastic_gears[level]
    on_teeth = TWO_TEETH if level == "plane" else [in_three_slices(load) for load in TWO_TEETH]
    gear, forces = elastic.gear, nodal_forces(elastic, on_teeth)
    hub = elastic.in_fixed_axes(elastic.stiffness.matrix @ elastic.displacement(forces) - forces)
    applied, total = elastic.in_fixed_axes(forces), sum(load.force.sum() for load in on_teeth)
    assert hub.sum(axis=1) == pytest.approx(-applied.sum(axis=1), abs=(2e-5 if gear.beta else 1e-9) * total)
    corners = np.repeat(elastic.section.doflocs, elastic.axial.size, axis=1)
    x, y = turned(corners, elastic.gear.twist * np.tile(elastic.axial, elastic.section.N))
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
    points[:2] = turned(points[:2], elastic.gear.twist * points[2])
    u = (rate[:dim, :dim] @ points[:dim]).reshape(dim, -1, elastic.axial.size)
    u[:2] = turned(u[:2], -elastic.gear.twist * elastic.axial)
    lame, mu = 210e9 * 0.3 / 1.3 / 0.4, 210e9 / 2.6
    expected = np.zeros((3, 3))
    expected[:dim, :dim] = 2 * mu * strain
    expected += lame * np.trace(strain) * np.eye(3)
    recovered = stress(elastic, u.ravel())
    assert np.abs(recovered - expected[..., None]).max() < error * expected.max()


def test_von_mises_of_tension_and_shear():
    tension, shear = np.diag([5.0, 0, 0]), np.array([[0, 2.0, 0], [2, 0, 0], [0, 0, 0]])
    assert von_mises(np.stack([tension, shear], axis=2)) == pytest.approx([5, 2 * np.sqrt(3)])


def test_stress_under_a_small_contact_is_that_of_a_half_plane():
    """Von Mises 0.5575 p0 at depth 0.70 a (Johnson, Contact Mechanics, 4.2: line contact, nu 0.3)."""
    load, half, peak = hertz_load(93.65e3 / 400)
    elastic = section_around_loads(GEAR, COARSE, [load], 1 / 6)
    equivalent = von_mises(stress_under(elastic, [load]))
    middle = load.extent[:1]
    depth = tooth_boundary.inward_normal(GEAR, 0, middle)[:2, 0] @ (elastic.mesh.p - flank_points(GEAR, middle))
    highest = np.argmax(equivalent)
    assert equivalent[highest] / peak == pytest.approx(0.5575, rel=0.01)
    assert depth[highest] / half == pytest.approx(0.70, abs=0.07)


@pytest.mark.parametrize("level", ["plane", "helical"])
def test_displacements_of_two_loads_are_reciprocal(level, elastic_gears):
    """Betti: the work of each load on the displacement of the other load is the same."""
    elastic = elastic_gears[level]
    loads = (load if level == "plane" else in_three_slices(load) for load in TWO_TEETH)
    first, second = (nodal_forces(elastic, [load]) for load in loads)
    work = first @ elastic.displacement(second)
    assert second @ elastic.displacement(first) == pytest.approx(work, rel=1e-9)
    assert abs(work) < np.sqrt((first @ elastic.displacement(first)) * (second @ elastic.displacement(second)))


@pytest.mark.parametrize("level", ["plane", "solid", "helical"])
def test_pressure_of_every_strip_appears_at_the_nearest_point(level, elastic_gears):
    """However small the strip is against an element; and nowhere else on the flanks."""
    elastic, low, high = elastic_gears[level], np.array([-9.0, -2.0]) * mm, np.array([-2.0, 2.0]) * mm
    arcs = np.add.outer([0.0, 1 * mm], hertz_load(93e3)[0].edges[0])
    load = replace(TWO_TEETH[0], edges=arcs, low=low, high=high, force=np.add.outer([85.0, 60.0], np.arange(12.0)))
    load = load.section(-3 * mm) if level == "plane" else load
    pressure = contact_pressure(elastic, [load]).reshape(-1, elastic.axial.size)
    strips = load.force / np.diff(load.edges) / (load.high - load.low)[:, None] * np.cos(elastic.gear.beta_b)
    assert pressure.max() == pytest.approx(strips.max(), rel=1e-12)
    facets = elastic.section.mesh.facets[:, tooth_boundary.outline(elastic.gear, elastic.section.mesh, 0)[0]]
    ends = ((elastic.section.mesh.p[:, facets] ** 2).sum(axis=0) - elastic.gear.r_b**2) / (2 * elastic.gear.r_b)
    far = np.abs(ends[:, :, None] - load.middle.ravel()).min(axis=2) > np.abs(ends[1] - ends[0]).max()
    assert far.any() and not pressure[facets[far]].any()
    assert level == "plane" or not pressure[:, np.abs(elastic.axial_mesh.p[0] + 3.5 * mm) > 9 * mm].any()


def test_bad_loads_are_refused(plane):
    with pytest.raises(ValueError, match="shape"):
        load_on([0.0, 1.0], [0.0, 0.0])
    with pytest.raises(ValueError, match="increase"):
        load_on([1.0, 0.0], [0.0])
    with pytest.raises(ValueError, match="not on the mesh"):
        nodal_forces(plane, [hertz_load(1.0, 7)[0]])
