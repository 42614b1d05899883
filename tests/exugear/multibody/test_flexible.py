"""A flexible shaft under a gear, against beam theory and the rigid shaft; the integrator chosen for it."""

import sys
from copy import copy
from pathlib import Path

import exudyn as exu
import exudyn.itemInterface as eii
import numpy as np
import pytest
from scenes import paper_pair, smooth_law
from scipy.linalg import expm
from scipy.optimize import brentq
from scipy.sparse.linalg import eigsh

import exugear
from exugear import integrator
from exugear.multibody.solver_settings import highest_frequency
from fem import STEEL
from fem.units import um

sys.path.insert(0, str(Path(__file__).parents[3] / "examples"))
import flexible_shaft as example
import shaft_modes
import shaft_rig

PAIR = paper_pair()
FORCE = example.TORQUE / PAIR.pinion.r_b


@pytest.fixture(scope="module")
def solid():
    return example.reduced(example.solid_shaft())


@pytest.fixture(scope="module")
def law() -> exugear.MeshForce:
    return smooth_law(damping=example.MESH_DAMPING)


@pytest.fixture(scope="module")
def flexible(solid, law):
    return example.equilibrium(example.build(PAIR, law, solid))


def beam_frequency(low: float, high: float) -> float:
    """Bending frequency [Hz] of the free Timoshenko beam between two bounds (transfer matrix)."""
    area, inertia, density = np.pi * shaft_modes.DIAMETER**2 / 4, np.pi * shaft_modes.DIAMETER**4 / 64, STEEL.density
    shear = STEEL.E / (2 * (1 + STEEL.nu)) * area * 6 * (1 + STEEL.nu) / (7 + 6 * STEEL.nu)

    def free_end(frequency):
        square = (2 * np.pi * frequency) ** 2
        rate = np.zeros((4, 4))
        rate[0, 1], rate[0, 3], rate[1, 2] = 1, 1 / shear, 1 / (STEEL.E * inertia)
        rate[2, 1], rate[2, 3], rate[3, 0] = -density * inertia * square, -1, -density * area * square
        return np.linalg.det(expm(shaft_modes.LENGTH * rate)[2:, :2])

    return brentq(free_end, low, high)


def test_mass_and_elasticity_are_those_of_the_cylinder(solid):
    mass = STEEL.density * np.pi / 4 * shaft_modes.DIAMETER**2 * shaft_modes.LENGTH
    assert solid.massMatrix[::3, ::3].sum() == pytest.approx(mass, rel=1e-3)
    squares = eigsh(solid.stiffnessMatrix, 12, solid.massMatrix, sigma=-1e6, return_eigenvectors=False)
    free = np.sqrt(np.sort(squares)[6:]) / (2 * np.pi)
    assert free[:2] == pytest.approx(2 * [beam_frequency(1500, 2500)], rel=2e-3)
    assert free[2:4] == pytest.approx(2 * [beam_frequency(4500, 5500)], rel=4e-3)
    assert free[4] == pytest.approx(example.torsion_frequency(), rel=1e-3)


def test_reduced_shaft_keeps_bending_and_torsion_but_for_its_rigid_sections(solid):
    frequencies = example.free_frequencies(solid)
    assert frequencies[:2] == pytest.approx(2 * [beam_frequency(1500, 2500)], rel=0.02)
    assert frequencies[2:4] == pytest.approx(2 * [beam_frequency(4500, 5500)], rel=0.02)
    assert frequencies[4] == pytest.approx(example.torsion_frequency(), rel=0.01)
    assert frequencies[4] > example.torsion_frequency() and frequencies[0] > beam_frequency(1500, 2500)


def test_static_deflection_is_that_of_a_timoshenko_beam(flexible):
    assert example.bending(flexible) == pytest.approx(example.beam_deflection(FORCE), rel=0.02)
    gear, left_bearing, right_bearing = flexible.positions()
    assert np.hypot(*left_bearing[:2]) == pytest.approx(FORCE / 2 / shaft_rig.BEARING, rel=0.01)
    assert left_bearing[:2] == pytest.approx(right_bearing[:2], rel=1e-3)
    away = np.arctan2(-gear[0], -gear[1])
    assert away == pytest.approx(PAIR.alpha_wt, abs=0.01)


def test_torque_twists_the_shaft_between_its_end_and_the_gear(flexible):
    polar, shear = np.pi * shaft_modes.DIAMETER**4 / 32, STEEL.E / (2 * (1 + STEEL.nu))
    angles = [flexible.mbs.GetMarkerOutput(marker, exu.OutputVariableType.Rotation)[2] for marker in flexible.markers]
    twist = example.TORQUE * shaft_modes.LENGTH / 2 / (shear * polar)
    assert angles[1] - angles[0] == pytest.approx(twist, rel=0.01)
    assert angles[2] - angles[0] == pytest.approx(0, abs=0.01 * twist)


def test_gear_on_the_floating_frame_adds_no_frequency(flexible, solid):
    assert highest_frequency(flexible.mbs) < 1.05 * example.free_frequencies(solid)[-1]


@pytest.mark.slow
def test_both_integrators_carry_the_torque_and_agree(solid, law):
    stiffer, peaks = example.reduced(copy(solid), 8), []
    for body, tolerance, beta in ((solid, 1e-3, 1 / 12), (stiffer, 1e-2, 0.25)):
        rig = example.equilibrium(example.build(PAIR, law, body))
        settings = integrator(rig.mbs, 1.0, example.MESH_RESONANCE, tolerance=tolerance)
        assert settings.timeIntegration.generalizedAlpha.newmarkBeta == pytest.approx(beta)
        times, _ = example.run(rig, tolerance=tolerance)
        assert example.last_cycles(times, rig.recorder.force, 20, 57).mean() == pytest.approx(FORCE, rel=1e-3)
        peaks.append(np.ptp(example.last_cycles(times, rig.recorder.deflection, 20, 57)))
    assert peaks[0] == pytest.approx(peaks[1], rel=0.01)
    rigid = example.equilibrium(example.build(PAIR, law))
    times, _ = example.run(rigid)
    assert example.bending(rigid) < 1e-3 * um
    assert example.last_cycles(times, rigid.recorder.force, 20, 57).mean() == pytest.approx(FORCE, rel=2e-3)
    assert np.ptp(example.last_cycles(times, rigid.recorder.deflection, 20, 57)) > peaks[0] + 1 * um


@pytest.mark.slow
def test_gear_on_the_floating_frame_moves_like_one_on_a_joint(solid, law, monkeypatch):
    def jointed(mbs, position, solid):
        frame, sections = on_frame(mbs, position, solid)
        frames.append(frame)
        node = mbs.AddNode(eii.NodeRigidBodyRxyz(referenceCoordinates=[*position, 0, 0, 0, 0]))
        body = mbs.AddObject(eii.ObjectRigidBody(nodeNumber=node, mass=1e-6, inertia=3 * [1e-9] + 3 * [0]))
        marker = mbs.AddMarker(eii.MarkerBodyRigid(bodyNumber=body))
        mbs.AddObject(eii.ObjectJointGeneric(markerNumbers=[sections[0], marker]))
        return node, sections

    def turning(rig):
        driving, driven = spins(rig)
        return [driving, *(rig.mbs.GetNodeODE2Index(frame) + 5 for frame in frames)], driven

    on_frame, spins, frames, moved = example.flexible_shaft, example.spins, [], []
    monkeypatch.setattr(example, "spins", turning)
    for shaft in (on_frame, jointed):
        monkeypatch.setattr(shaft_rig, "flexible_shaft", shaft)
        rig = example.equilibrium(example.build(PAIR, law, solid))
        times, _ = example.run(rig)
        moved.append(example.last_cycles(times, rig.recorder.deflection, 20, 57))
    assert moved[0].mean() == pytest.approx(moved[1].mean(), rel=1e-3)
    assert moved[0].std() == pytest.approx(moved[1].std(), rel=1e-3)


def chain(soft: float, stiff: float):
    """Two unit masses: one of eigenfrequency soft [Hz] on the ground, one of eigenfrequency stiff beside it."""
    container = exu.SystemContainer()
    mbs = container.AddSystem()
    mbs.variables["container"] = container
    fixed = mbs.AddMarker(eii.MarkerNodeCoordinate(nodeNumber=mbs.AddNode(eii.NodePointGround()), coordinate=0))
    for frequency, start in ((soft, 1e-3), (stiff, 0.0)):
        node = mbs.AddNode(eii.Node1D(referenceCoordinates=[0.0], initialCoordinates=[start]))
        mbs.AddObject(eii.ObjectMass1D(mass=1.0, nodeNumber=node))
        marker = mbs.AddMarker(eii.MarkerNodeCoordinate(nodeNumber=node, coordinate=0))
        stiffness = (2 * np.pi * frequency) ** 2
        mbs.AddObject(eii.CoordinateSpringDamper(markerNumbers=[fixed, marker], stiffness=stiffness))
    mbs.Assemble()
    return mbs


@pytest.mark.parametrize(("stiff", "beta"), [(500.0, 1 / 12), (3e3, 1 / 12), (5e5, 0.25)])
def test_stiff_models_fall_back_to_the_trapezoidal_rule(stiff, beta):
    mbs, time = chain(100.0, stiff), 0.10125
    assert highest_frequency(mbs) == pytest.approx(stiff, rel=1e-6)
    settings = integrator(mbs, time, 100.0)
    assert settings.timeIntegration.generalizedAlpha.newmarkBeta == pytest.approx(beta)
    step = time / settings.timeIntegration.numberOfSteps
    assert beta == 0.25 or 2 * np.pi * stiff * step < 6**0.5
    mbs.SolveDynamic(settings)
    soft, still = mbs.systemData.GetODE2Coordinates()
    assert soft == pytest.approx(1e-3 * np.cos(2 * np.pi * 100 * time), abs=2e-5)
    assert abs(still) < 1e-9


@pytest.mark.parametrize(("arguments", "word"), [((0.0, 100.0), "duration"), ((1.0, 0.0), "frequency")])
def test_integrator_refuses_arguments_out_of_range(arguments, word):
    with pytest.raises(ValueError, match=word):
        integrator(chain(100.0, 200.0), *arguments)


def test_integrator_leaves_the_current_state():
    """Exudyn's linearization replaces it by the initial one."""
    mbs, current = chain(100.0, 200.0), exu.ConfigurationType.Current
    mbs.SolveDynamic(integrator(mbs, 0.0123, 100.0))
    states = [(*mbs.systemData.GetODE2Coordinates(), *mbs.systemData.GetODE2Coordinates_t())]
    assert mbs.systemData.GetTime(current) == pytest.approx(0.0123)
    integrator(mbs, 1.0, 100.0)
    states.append((*mbs.systemData.GetODE2Coordinates(), *mbs.systemData.GetODE2Coordinates_t()))
    assert states[0] == states[1]
    assert mbs.systemData.GetTime(current) == pytest.approx(0.0123)


def test_integrator_wants_an_assembled_system():
    mbs = chain(100.0, 200.0)
    mbs.AddNode(eii.Node1D(referenceCoordinates=[0.0]))
    with pytest.raises(ValueError, match=r"mbs must be assembled; call mbs.Assemble"):
        integrator(mbs, 1.0, 100.0)
