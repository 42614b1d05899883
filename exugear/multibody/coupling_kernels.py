"""The kernel of a coupling behind whose spring a rotor turns as imposed."""

from functools import cache

import numpy as np

from exugear.contact.imposed_motion import spin_of
from exugear.gearbox.shaft import Coupling
from exugear.mesh_force.kernel_records import address_of, reader, record_type
from fem.support.numba_cache import kept

#: Inertia of the rotor [kg m^2], torsional stiffness [N m/rad] and damping [N m s/rad] of the coupling, address of the
#: `IMPOSED_MOTION` of the rotor.
COUPLING = record_type(("inertia", "f8"), ("torsion", "f8"), ("damping", "f8"), ("motion", "i8"))
coupling_at = reader(COUPLING)


def coupling_record(coupling: Coupling, motion: np.record) -> np.record:
    """The record of a coupling whose rotor has an imposed motion."""
    record = np.zeros(1, COUPLING)[0]
    record.inertia, record.torsion, record.damping = coupling.inertia, coupling.torsion, coupling.damping
    record.motion = address_of(motion)
    return record


@cache
def coupling_kernel(n: int):
    """The function (record, t, *coordinates, *velocities) -> forces of the rotor and of a shaft with n coordinates.

    record is the address of a `COUPLING`. The last coordinate of the shaft is its spin.
    """

    @kept
    def driven_coupling(record, t, *x):
        coupling = coupling_at(record)
        rotor = spin_of(coupling.motion, t, 0.0, 0.0)
        torque = coupling.torsion * (rotor.angle - x[n]) + coupling.damping * (rotor.speed - x[2 * n + 1])
        on_rotor = (coupling.inertia * rotor.acceleration,)
        if n == 1:
            return (*on_rotor, torque)
        if n == 3:
            return (*on_rotor, 0.0, 0.0, torque)
        return (*on_rotor, 0.0, 0.0, 0.0, 0.0, 0.0, torque)

    return driven_coupling
