"""Layout of the packed table of a mesh force: a head with sizes and scalars, and the arrays behind it.

Behind the head lie the values of the offsets' axes and, for each combination of them (a block) and each phase step, an
edge, the nodes over u = (penetration / largest penetration)^(1/4) and the force centroids at the nodes.
"""

import numpy as np

from exugear.force_table.kernel_records import record_type

PHASES = 512
#: With offsets there are many blocks, which need fewer phases for the same size.
PHASES_WITH_OFFSETS = 256
PENETRATIONS = 64
U = np.linspace(0, 1, PENETRATIONS + 1)
OFFSETS = ("a", "misalignment", "axial")
#: Sizes; scalars of the law; forces [N] and tangent stiffnesses [N/m], the last ones means over phase; where the
#: arrays begin [bytes from the head].
FORCE_TABLE = record_type(
    ("phase_steps", "i8"),
    ("penetration_steps", "i8"),
    ("offset_counts", "i8", 3),
    ("conserves", "i8"),
    ("backlash", "f8"),
    ("back_phase", "f8"),
    ("damping", "f8"),
    ("damping_ramp", "f8"),
    ("last_force", "f8"),
    ("last_stiffness", "f8"),
    ("largest_stiffness", "f8"),
    ("axes_start", "i8", 3),
    ("edges_start", "i8"),
    ("nodes_start", "i8"),
    ("centroids_start", "i8"),
)
#: Unloaded deflection, largest penetration [m], and their slopes per phase step.
EDGE = record_type(*((name, "f8") for name in ("unloaded", "unloaded_slope", "largest", "largest_slope")))
#: Secant stiffness [N/m], or potential over penetration^2, and its slopes per phase step and per step of u.
NODE = record_type(*((name, "f8") for name in ("value", "by_phase", "by_u", "by_phase_u")))


def table_type(counts: tuple[int, ...], phase_steps: int) -> np.dtype:
    """Type of a whole table with so many values of the offsets (3) and so many phase steps."""
    over_nodes = (*counts, phase_steps, U.size)
    return record_type(
        ("head", FORCE_TABLE),
        *((name, "f8", count) for name, count in zip(OFFSETS, counts, strict=True)),
        ("edges", EDGE, (*counts, phase_steps)),
        ("nodes", NODE, over_nodes),
        ("centroids", "f8", over_nodes),
    )


def start_of_field(kind: np.dtype, name: str) -> int:
    """Bytes from the start of a record to a field."""
    return kind.fields[name][1]  # type: ignore[index]
