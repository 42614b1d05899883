"""The compiled contact that Exudyn's user function calls: a function for each pair of kinds of bodies."""

from functools import cache

from exugear.contact.body_motion import SIZES, forces_on, motions_of, recorded_motions
from exugear.contact.contact_records import frame_at, state_at
from exugear.contact.first_guess import begin_call, begin_solve
from exugear.contact.imposed_motion import spin_in_space, spin_of, torque_on, with_torque_on
from exugear.contact.kinematics import NO_OFFSETS, rotational_mesh, spatial_mesh
from exugear.contact.recorder import recorded_components, sample_of, write, write_motion, write_power
from exugear.contact.relative_position import driving_phase
from exugear.contact.rotation import EULER, IN_PLANE, RXYZ, SPIN_ALONE, UPRIGHT, VECTOR
from exugear.contact.vectors import row_total
from exugear.mesh_force.patches import table_at
from fem.support.numba_cache import compiled, kept

SPIN, PLANAR, SPATIAL = "spin", "planar", "spatial"
PARAMETERS, ROTATION_VECTOR = "Euler parameters", "rotation vector"
CODES = {SPIN: SPIN_ALONE, PLANAR: IN_PLANE, SPATIAL: RXYZ, PARAMETERS: EULER, ROTATION_VECTOR: VECTOR}


def codes_of(kinds: tuple[str, ...], rotated: bool) -> list[int]:
    """Codes of the bodies, those on Rxyz nodes upright unless the contact frame is rotated."""
    return [UPRIGHT if kind == SPATIAL and not rotated else CODES[kind] for kind in kinds]


@cache
def kernel_of(kinds: tuple[str, ...], displaced: bool = False, rotated: bool = False):
    """The function (table, frame, state, record, t, *coordinates, *velocities) -> generalized forces of two bodies.

    The first four are addresses: of a table's head, a contact frame, a contact state and a recorder's header.
    Coordinates and velocities are separate arguments: a list would cost 14 us more in each call from Python. Three
    bodies that only spin are pinion, wheel and their carrier.

    displaced   whether bodies that only spin are displaced from the pair's nominal positions
    rotated     whether the contact frame is rotated against the global one
    """
    if kinds == (SPIN, SPIN) and not displaced and not rotated:
        return spin_contact
    return carrier_contact if kinds == (SPIN, SPIN, SPIN) else _spatial_contact(*codes_of(kinds, rotated))


@compiled
def write_spins(record, k, table, mesh, torques, angles, speeds):
    """Store sample k of the mesh of bodies that spin."""
    mesh_state = mesh.deflection, mesh.force, driving_phase(table, mesh.flank)
    write(record, k, mesh_state, NO_OFFSETS, 0.0, torques)
    write_power(record, k, mesh.energy, mesh.dissipation, angles, speeds)


@compiled
def write_mesh(record, k, components, table, mesh, torques, pinion, wheel):
    """Store sample k of the mesh of bodies in space with these `Motion`."""
    mesh_state = mesh.deflection, mesh.force, driving_phase(table, mesh.position.flank)
    write(record, k, mesh_state, mesh.offsets, mesh.centroid, torques)
    write_motion(record, k, components, (pinion.q, wheel.q, pinion.v, wheel.v))
    spins, speeds = (pinion.q[5], wheel.q[5]), (pinion.v[5], wheel.v[5])
    write_power(record, k, mesh.energy, mesh.dissipation, spins, speeds)


@kept
def spin_contact(table, frame, state, record, t, q_1, q_2, v_1, v_2):
    """Torques on two bodies that spin about fixed axes."""
    contact = state_at(state)
    begin_call(contact.steps, t)
    pinion, wheel = spin_of(contact.imposed[0], t, q_1, v_1), spin_of(contact.imposed[1], t, q_2, v_2)
    (q_1, v_1, _), (q_2, v_2, _) = pinion, wheel
    mesh = rotational_mesh(table_at(table), frame_at(frame), contact, q_1, q_2, v_1, v_2)
    torques = mesh.torques[0] + mesh.pulse[0], mesh.torques[1] + mesh.pulse[1]
    k = sample_of(record, t)
    if k >= 0:
        write_spins(record, k, table_at(table), mesh, torques, (q_1, q_2), (v_1, v_2))
    return torque_on(contact, 0, pinion, torques[0]), torque_on(contact, 1, wheel, torques[1])


@kept
def carrier_contact(table, frame, state, record, t, q_1, q_2, q_3, v_1, v_2, v_3):
    """Torques on two bodies that spin and on the carrier of their axes."""
    torques = spin_contact(table, frame, state, record, t, q_1 - q_3, q_2 - q_3, v_1 - v_3, v_2 - v_3)
    return torques[0], torques[1], -torques[0] - torques[1]


def _spatial_contact(kind_1: int, kind_2: int):
    """The compiled function of two kinds of bodies.

    It encloses numbers only, by which the cache on disk identifies it; branches that they exclude are not compiled.
    """
    n_1, n_2 = SIZES[kind_1], SIZES[kind_2]
    components = recorded_components(n_1, n_2)

    @kept
    def spatial_contact(table, frame, state, record, t, *x):
        geometry, contact = frame_at(frame), state_at(state)
        begin_call(contact.steps, t)
        begin_solve(contact, t)
        pinion, wheel = motions_of(geometry, kind_1, kind_2, n_1, n_2, x)
        pinion_spin, pinion = spin_in_space(contact.imposed[0], t, pinion)
        wheel_spin, wheel = spin_in_space(contact.imposed[1], t, wheel)
        mesh = spatial_mesh(table_at(table), geometry, contact, pinion.q, wheel.q, pinion.v, wheel.v)
        forces_1, forces_2 = row_total(mesh.pinion, mesh.pulse[0]), row_total(mesh.wheel, mesh.pulse[1])
        k = sample_of(record, t)
        if k >= 0:
            torques = forces_1[5], forces_2[5]
            motions = recorded_motions(geometry, kind_1, kind_2, n_1, n_2, x, pinion, wheel)
            write_mesh(record, k, components, table_at(table), mesh, torques, *motions)
        f = forces_on(kind_1, pinion.orientation, forces_1)
        g = forces_on(kind_2, wheel.orientation, forces_2)
        f, g = with_torque_on(contact, 0, pinion_spin, f), with_torque_on(contact, 1, wheel_spin, g)
        on_pinion = (f[5],) if n_1 == 1 else (f[0], f[1], f[5]) if n_1 == 3 else f[:n_1]
        on_wheel = (g[5],) if n_2 == 1 else (g[0], g[1], g[5]) if n_2 == 3 else g[:n_2]
        return on_pinion + on_wheel

    return spatial_contact
