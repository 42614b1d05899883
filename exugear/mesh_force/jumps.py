"""Jumps of a mesh force over phase; `exugear.planning.sampling` chooses time steps that meet them."""

import numpy as np

#: A jump is a change by this share of the force's range over phase, at a fixed deflection, within this part of a pitch.
SHARE, WIDTH = 0.45, 1 / 256
#: Number of phases at which the force is compared; share of the largest force below which a change is no jump.
FINE, FLAT = 4096, 1e-3
#: Share of the deflection range between the deflection at which jumps are detected and the end of the table.
MARGIN = 0.1


def jumps(force) -> np.ndarray:
    """(n,) phases at which a `MeshForce` jumps near its largest deflection; offsets at the middle of their axes."""
    if force.offsets:
        middle = {name: float(values[values.size // 2]) for name, values in force.offsets.items()}
        return jumps(force.flank_at(1, **middle))
    phase, window = np.arange(FINE) / FINE, round(WIDTH * FINE)
    deflection = np.broadcast_to(force.deflection, force.force_table.shape)
    span = float((deflection[:, -1] - deflection[:, 0]).min())
    values = force(phase, float(deflection[:, -1].min()) - MARGIN * span)
    least = max(SHARE * np.ptp(values), FLAT * np.abs(values).max())
    steep = np.abs(np.roll(values, -window) - values) > least
    if not steep.any() or steep.all():
        return np.zeros(0)
    begins, ends = (np.flatnonzero(steep & ~np.roll(steep, k)) for k in (1, -1))
    ends = np.where(ends[0] < begins[0], np.roll(ends, -1), ends)
    middles = begins + (ends - begins) % FINE / 2 + window / 2
    return np.sort(middles / FINE % 1.0)
