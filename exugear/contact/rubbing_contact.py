"""The compiled contact with friction: it evaluates the mesh force once for the contact and its friction."""

from functools import cache

from exugear.contact.body_motion import SIZES, forces_on, motions_of, recorded_motions
from exugear.contact.contact_kernels import SPIN, codes_of, write_mesh, write_spins
from exugear.contact.contact_records import frame_at, state_at
from exugear.contact.first_guess import begin_call, begin_solve
from exugear.contact.friction_kernels import friction_at, friction_in_space, friction_of_spins
from exugear.contact.imposed_motion import spin_in_space, spin_of, torque_on, with_torque_on
from exugear.contact.kinematics import rotational_mesh, spatial_mesh
from exugear.contact.recorder import recorded_components, sample_of, write_friction
from exugear.contact.vectors import row_total
from exugear.mesh_force.patches import table_at
from fem.support.numba_cache import kept


@cache
def rubbing_contact_of(kinds: tuple[str, ...], displaced: bool = False, rotated: bool = False):
    """`contact_kernels.kernel_of` with friction: (table, frame, state, friction, record, t, *coordinates, *velocities).

    The torques that it records are those of mesh and friction together.
    """
    if kinds == (SPIN, SPIN) and not displaced and not rotated:
        return spin_contact
    return carrier_contact if kinds == (SPIN, SPIN, SPIN) else _spatial_contact(*codes_of(kinds, rotated))


@kept
def spin_contact(table, frame, state, friction, record, t, q_1, q_2, v_1, v_2):
    """Torques on two bodies that spin about fixed axes."""
    geometry, contact = frame_at(frame), state_at(state)
    begin_call(contact.steps, t)
    pinion, wheel = spin_of(contact.imposed[0], t, q_1, v_1), spin_of(contact.imposed[1], t, q_2, v_2)
    (q_1, v_1, _), (q_2, v_2, _) = pinion, wheel
    mesh = rotational_mesh(table_at(table), geometry, contact, q_1, q_2, v_1, v_2)
    sliding = friction_of_spins(friction_at(friction), geometry, mesh.flank.phase, mesh.static_force, v_1, v_2)
    torques = (
        mesh.torques[0] + mesh.pulse[0] + sliding.torques[0],
        mesh.torques[1] + mesh.pulse[1] + sliding.torques[1],
    )
    k = sample_of(record, t)
    if k >= 0:
        write_spins(record, k, table_at(table), mesh, torques, (q_1, q_2), (v_1, v_2))
        write_friction(record, k, sliding.force, sliding.loss)
    return torque_on(contact, 0, pinion, torques[0]), torque_on(contact, 1, wheel, torques[1])


@kept
def carrier_contact(table, frame, state, friction, record, t, q_1, q_2, q_3, v_1, v_2, v_3):
    """Torques on two bodies that spin and on the carrier of their axes."""
    torques = spin_contact(table, frame, state, friction, record, t, q_1 - q_3, q_2 - q_3, v_1 - v_3, v_2 - v_3)
    return torques[0], torques[1], -torques[0] - torques[1]


def _spatial_contact(kind_1: int, kind_2: int):
    """The compiled contact with friction of two kinds of bodies, as `contact_kernels._spatial_contact`."""
    n_1, n_2 = SIZES[kind_1], SIZES[kind_2]
    components = recorded_components(n_1, n_2)

    @kept
    def rubbing_contact(table, frame, state, friction, record, t, *x):
        geometry, contact = frame_at(frame), state_at(state)
        begin_call(contact.steps, t)
        begin_solve(contact, t)
        pinion, wheel = motions_of(geometry, kind_1, kind_2, n_1, n_2, x)
        pinion_spin, pinion = spin_in_space(contact.imposed[0], t, pinion)
        wheel_spin, wheel = spin_in_space(contact.imposed[1], t, wheel)
        mesh = spatial_mesh(table_at(table), geometry, contact, pinion.q, wheel.q, pinion.v, wheel.v)
        sliding = friction_in_space(
            friction_at(friction), geometry, mesh.position, mesh.static_force, mesh.centroid, pinion.v, wheel.v
        )
        forces_1 = row_total(row_total(mesh.pinion, mesh.pulse[0]), sliding.pinion)
        forces_2 = row_total(row_total(mesh.wheel, mesh.pulse[1]), sliding.wheel)
        k = sample_of(record, t)
        if k >= 0:
            torques = forces_1[5], forces_2[5]
            motions = recorded_motions(geometry, kind_1, kind_2, n_1, n_2, x, pinion, wheel)
            write_mesh(record, k, components, table_at(table), mesh, torques, *motions)
            write_friction(record, k, sliding.force, sliding.loss)
        f = forces_on(kind_1, pinion.orientation, forces_1)
        g = forces_on(kind_2, wheel.orientation, forces_2)
        f, g = with_torque_on(contact, 0, pinion_spin, f), with_torque_on(contact, 1, wheel_spin, g)
        on_pinion = (f[5],) if n_1 == 1 else (f[0], f[1], f[5]) if n_1 == 3 else f[:n_1]
        on_wheel = (g[5],) if n_2 == 1 else (g[0], g[1], g[5]) if n_2 == 3 else g[:n_2]
        return on_pinion + on_wheel

    return rubbing_contact
