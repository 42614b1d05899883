"""A diverged solve is reported as such, without asking for a larger map."""

import exudyn as exu
import exudyn.itemInterface as eii
import numpy as np
import pytest
from exudyn.rigidBodyUtilities import InertiaCuboid
from scenes import paper_pair, smooth_map

import exugear
from exugear.multibody.user_function_errors import stop_error
from fem import ste_map
from fem.units import mm

PAIR = paper_pair()


def law_over_misalignment() -> exugear.MeshForce:
    ste, axis = smooth_map((0, 1, 20, 50, 150, 350)), np.array([-2e-4, 0, 2e-4])
    te = ste["te"].values[:, None] * np.array([1.1, 1, 1.1])[None, :, None]
    values = ste["torque"].values, ste["phase"].values
    return exugear.MeshForce.from_ste(ste_map(PAIR, *values, te, {"misalignment": axis}))


@pytest.mark.parametrize(
    ("tilt", "message"),
    [
        (10.0, "lies far beyond the map's axis .* the solve diverged: hold bodies"),
        (2e5, "lies beyond .* extend the axis"),
    ],
)
def test_gears_on_very_low_tilt_stiffness(tilt, message):
    """Static solve by hand, gears 10 mm beside their supports: on 10 N m/rad they tilt by a third of a radian."""
    container = exu.SystemContainer()
    mbs, bodies = container.AddSystem(), []
    for x, spin in ((0.0, 1e6), (PAIR.a, 0.0)):
        inertia, kind = InertiaCuboid(7850, [0.1, 0.1, 23 * mm]), exu.NodeType.RotationRxyz
        bodies.append(mbs.CreateRigidBody(referencePosition=[x, 0, 0], inertia=inertia, nodeType=kind))
        node, springs = mbs.GetObject(bodies[-1])["nodeNumber"], np.diag([5e8, 5e8, 1e8, tilt, tilt, spin])
        mbs.AddObject(eii.ObjectGenericODE2(nodeNumbers=[node], stiffnessMatrix=springs))
    centres = [[0, 0, 10 * mm]] * 2
    mbs.CreateGearContact(itemNumbers=bodies, pair=PAIR, force=law_over_misalignment(), localPositions=centres)
    mbs.CreateTorque(itemNumber=bodies[1], loadVector=[0, 0, 150.0])
    mbs.Assemble()
    settings = exu.SimulationSettings()
    settings.solution.file.write = False
    with pytest.raises(RuntimeError, match=f"misalignment .* {message}"):
        mbs.SolveStatic(settings)


@pytest.mark.parametrize(
    ("left", "message"),
    [
        ((20e-6, 15e-6), "extend the map to a larger torque"),
        ((1.5e-3, 15e-6), "deflection 1500 um lies far beyond the map's 15 um; the solve diverged"),
        ((130 * mm, 139 * mm), "a must stay above 139 mm, the base radii's sum, got 130 mm; the solve diverged"),
        ((0.2, 0.1501, 0.1502, 0), "a 0.2 lies far beyond .* the solve diverged"),
        ((0.1503, 0.1501, 0.1502, 0), "extend the axis"),
        ((np.nan, np.nan), "use a smaller step"),
    ],
)
def test_offsets_far_beyond_the_map_mean_divergence(left, message):
    with pytest.raises(RuntimeError, match=message):
        raise stop_error(law_over_misalignment().table.head, left)
