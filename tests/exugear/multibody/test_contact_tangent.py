"""Exact slopes of a contact: against differences away from kinks, by side at the kink."""

from functools import partial

import exudyn as exu
import numpy as np
import pytest
from exudyn.rigidBodyUtilities import RigidBodyInertia
from planetary_boxes import planar_box
from scenes import paper_pair, smooth_box
from spatial_meshes import SPUR, law_of

import exugear
from exugear.modal.mesh_tangents import contact_of

FRICTION = exugear.MeshFriction.of_pair(paper_pair(), 0.05)
PIN = exugear.Bearing(2e8, 1e8, 1e5)
#: Spins, bodies in space and in the plane; the law of the last over centre distance and misalignment.
BOXES = {
    "spins": smooth_box,
    "spins that rub": partial(smooth_box, friction=FRICTION),
    "in space": partial(smooth_box, PIN),
    "in space, rubbing": partial(smooth_box, PIN, friction=FRICTION),
    "planet and ring": planar_box,
}


def built(box) -> tuple:
    """A contact of a box, and its row."""
    model = exugear.build(box())
    mesh = model.meshes[-1]
    return contact_of(model.mbs, mesh.contact), mesh.row[model.mbs.systemData.GetObjectLTGODE2(mesh.contact)]


def by_hand(node) -> tuple:
    """A contact of two bodies on nodes of a kind, its law over centre distance and misalignment, and its row."""
    pair, mbs = SPUR, exu.SystemContainer().AddSystem()
    inertia = RigidBodyInertia(mass=3, inertiaTensor=np.diag([1e-2] * 3))
    options = {"inertia": inertia, "nodeType": node}
    bodies = [mbs.CreateRigidBody(referencePosition=[x, 0, 0], **options) for x in (0, pair.a)]
    number = mbs.CreateGearContact(itemNumbers=bodies, pair=pair, force=law_of(damping=2700.0, backlash=1e-4))
    mbs.Assemble()
    contact = contact_of(mbs, number)
    q = np.zeros(len(mbs.systemData.GetObjectLTGODE2(number)))
    q[q.size // 2 - 1] = 1e-5 / pair.pinion.r_b
    return contact, contact.row(q)


def differences(function, state: np.ndarray, steps) -> np.ndarray:
    """Slopes of a function of the state, of fourth order in the steps."""
    columns = []
    for step, unit in zip(steps, np.eye(state.size), strict=True):
        values = [np.array(function(*(state + k * step * unit))) for k in (-2, -1, 1, 2)]
        columns.append((values[0] - values[3] + 8 * (values[2] - values[1])) / (12 * step))
    return np.array(columns).T


def compare(contact, row, advance: float, step: float = 4e-8) -> None:
    """Slopes at random coordinates and velocities against differences."""
    n, random = row.size, np.random.default_rng(3)
    q = random.uniform(-1, 1, n) * 1e-5
    q, v = q + (advance - row @ q) * row / (row @ row), random.uniform(-1, 1, n) * 0.05
    if n == 14:
        for first in (3, 10):
            parameters = np.array([1.0, 0.0, 0.0, 0.0]) + q[first : first + 4]
            q[first : first + 4] = parameters / np.linalg.norm(parameters) - [1.0, 0.0, 0.0, 0.0]
    assert contact.force(q, v) != 0
    tangent = contact.copy.tangent(q, v)
    by_state = -differences(contact.forces, np.r_[q, v], [step] * n + [1e-2] * n)
    stiffness, damping = by_state[:, :n], by_state[:, n:]
    assert tangent.by_coordinates == pytest.approx(stiffness, abs=1e-8 * np.abs(stiffness).max())
    assert tangent.by_velocities == pytest.approx(damping, abs=1e-8 * np.abs(damping).max())


@pytest.mark.parametrize("box", BOXES.values(), ids=BOXES)
def test_slopes_are_those_of_differences_away_from_kinks(box):
    contact, row = built(box)
    for advance in (2e-5, 8e-6):
        compare(contact, row, advance)


def test_slopes_of_the_back_flank_are_those_of_differences():
    compare(*built(smooth_box), advance=-1.87e-3)


@pytest.mark.parametrize("node", ["RotationRxyz", "RotationEulerParameters"])
def test_slopes_of_a_law_over_offsets_are_those_of_differences(node):
    compare(*by_hand(getattr(exu.NodeType, node)), advance=1.2e-5)


def test_a_rotation_vector_is_no_angular_velocity():
    """Its rates are, so that slopes by coordinates and forces differ where it is not small."""
    contact, _ = by_hand(exu.NodeType.RotationRotationVector)
    q = np.array([0, 0, 0, 2e-5, -4e-5, 0.3 + 1.2e-5 / SPUR.pinion.r_b, 0, 0, 0, -2e-5, 2e-5, -0.3])
    assert contact.force(q) > 0
    stiffness = -differences(lambda *x: contact.forces(*x, *np.zeros(12)), q, [4e-8] * 12)
    assert contact.tangent(q).by_coordinates == pytest.approx(stiffness, abs=1e-8 * np.abs(stiffness).max())


def test_a_conservative_contact_has_a_symmetric_tangent():
    contact, row = built(partial(smooth_box, PIN))
    stiffness = contact.tangent(1e-5 * row / (row @ row)).by_coordinates
    assert stiffness == pytest.approx(stiffness.T, abs=1e-11 * np.abs(stiffness).max())


@pytest.mark.parametrize("box", [smooth_box, partial(smooth_box, PIN)])
def test_where_contact_ends_the_slopes_are_those_of_the_side(box):
    """A difference across the kink would give half the stiffness."""
    contact, row = built(box)
    touching, apart, nearby = (contact.tangent(x * row / (row @ row)) for x in (1e-12, -1e-12, 1e-9))
    assert not apart.by_coordinates.any()
    scale = np.abs(nearby.by_coordinates).max()
    assert touching.by_coordinates == pytest.approx(nearby.by_coordinates, abs=0.2 * scale)


@pytest.mark.parametrize("box", BOXES.values(), ids=BOXES)
def test_the_matrix_of_newtons_iteration_is_near(box):
    contact, row = built(box)
    q, v = 1.5e-5 * row / (row @ row), np.full(row.size, 0.02)
    exact = contact.copy.tangent(q, v)
    matrix = contact.copy.spring_matrix(0.0, q, v, (2.0, 3e-5))
    total = 2.0 * exact.by_coordinates + 3e-5 * exact.by_velocities
    assert matrix == pytest.approx(total, abs=1e-4 * np.abs(total).max())
