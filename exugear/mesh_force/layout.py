"""Layout of the packed table of a mesh force: a head with sizes and scalars, and the arrays behind it.

Behind the head lie the values of the offsets' axes with their slope weights and, for each combination of the values (a
block) and each phase step, an edge and the nodes of potential and force centroid over
u = (penetration / largest penetration)^(1/4).
"""

import numpy as np

from exugear.mesh_force.kernel_records import record_type

#: Phase steps in a pitch of a table; of a table with many blocks, and from how many blocks on: 3 MB a block with force
#: centroids. Each pitch of a law over several counts as a block.
PHASES, PHASES_OF_MANY, MANY_BLOCKS = 256, 128, 65
#: Phase steps in a pitch of a table from phases that are not uniform.
RESAMPLED = 1024
#: Steps of u, and their nodes.
PENETRATIONS = 128
U = np.linspace(0, 1, PENETRATIONS + 1)
OFFSETS = ("a", "misalignment", "axial")
#: Head of a table: numbers of steps and of offset values; whether all derivatives of the potential act, and whether the
#: force has a centroid beside mid-plane; scalars of the law; means over phase of force [N] and tangent stiffness [N/m]
#: at the end of the table; largest tangent stiffness of either flank; side: 1, of a coast flank's table -1; start of
#: that table, 0 where the coast flank is the mirror image; starts of the arrays [bytes from the head]; pitches after
#: which the law repeats, the reciprocal of their number, and phase steps in a pitch; start of the `TEETH` of which the
#: law is composed, 0 where it is not.
FORCE_TABLE = record_type(
    ("phase_steps", "i8"),
    ("penetration_steps", "i8"),
    ("offset_counts", "i8", 3),
    ("conserves", "i8"),
    ("has_centroid", "i8"),
    ("backlash", "f8"),
    ("back_phase", "f8"),
    ("damping", "f8"),
    ("damping_ramp", "f8"),
    ("last_force", "f8"),
    ("last_stiffness", "f8"),
    ("largest_stiffness", "f8"),
    ("side", "f8"),
    ("coast", "i8"),
    ("axes_start", "i8", 3),
    ("slopes_start", "i8", 3),
    ("edges_start", "i8"),
    ("potentials_start", "i8"),
    ("centroids_start", "i8"),
    ("pitches", "f8"),
    ("per_pitches", "f8"),
    ("steps_in_pitch", "f8"),
    ("teeth", "i8"),
)
#: Head of what a law is composed of, whose teeth differ: position [pitches] at which the table of a single tooth pair
#: begins, and up to which it reaches; numbers of couplings by distance and position, of positions of increments, of
#: their loads, of increments in a block, and of those of pinion and wheel among them; position at which couplings
#: begin, and their steps in a pitch; the same of increments, and the largest of their loads [N]; limit of the tilt by
#: which the moment of a tooth pair works, per load [rad/N], and most by which such moments let neighbours touch earlier
#: [m]; starts of the arrays [bytes from this head], pairs: of `TOOTH_PAIR` number 0, with those before and after it;
#: meeting: number of what increments of both gears have beside their sum, over those of pinion and wheel.
TEETH = record_type(
    *((name, "i8") for name in ("distances", "coupled", "placed", "loads")),
    *((name, "i8") for name in ("in_block", "of_pinion", "of_wheel")),
    *((name, "f8") for name in ("first", "last", "coupled_first", "coupled_steps", "placed_first", "placed_steps")),
    *((name, "f8") for name in ("largest_load", "tilt_by_load", "pull")),
    *((f"{name}_start", "i8") for name in ("pairs", "coupling", "meeting", "increments", "single")),
)
#: Teeth of a tooth pair, by the phase at which they meet at the pitch point: sum of their pitch deviations [m], how far
#: these move the tooth pair [pitches], and numbers of the increments of pinion and wheel (-1: none).
TOOTH_PAIR = record_type(("pitch", "f8"), ("moved", "f8"), ("variant_1", "i8"), ("variant_2", "i8"))
#: An increment of a tooth at a load and a position: the deflection and its integral over t, its slopes by t, by a step
#: of the position, and by both; t = sqrt(load / largest load); likewise the moment of the load.
INCREMENT = record_type(
    *((name, "f8") for name in ("value", "by_t", "by_s", "by_t_s", "work", "work_by_s")),
    *((name, "f8") for name in ("moment", "moment_by_t", "moment_by_s", "moment_by_t_s")),
)
#: Unloaded deflection, largest penetration [m], and their slopes per phase step; largest force of the law [N].
EDGE = record_type(
    *((name, "f8") for name in ("unloaded", "unloaded_slope", "largest", "largest_slope", "largest_force"))
)
#: A value, its first and second derivative per step of u, and the slopes of these three per phase step.
NODE = record_type(*((name, "f8") for name in ("value", "by_u", "by_uu", "by_phase", "by_phase_u", "by_phase_uu")))
#: Number of values whose weighted sum is the slope at a value of an axis.
SLOPE_WEIGHTS = 3


def steps_in_pitch(blocks: int, pitches: int) -> int:
    """Phase steps in a pitch of a table with a number of blocks over a number of pitches."""
    return PHASES if blocks * pitches < MANY_BLOCKS else PHASES_OF_MANY


def table_type(
    counts: tuple[int, ...],
    phase_steps: int,
    has_centroid: bool,
    coast: np.dtype | None = None,
    teeth: np.dtype | None = None,
) -> np.dtype:
    """Type of a whole table with counts (3) of the offset values and a number of phase steps.

    coast   type of the table of the coast flank; None where that is the mirror image
    teeth   type of what a law is composed of; None where it is not
    """
    over_nodes = (*counts, phase_steps, U.size)
    return record_type(
        ("head", FORCE_TABLE),
        *((name, "f8", count) for name, count in zip(OFFSETS, counts, strict=True)),
        *((f"{name}_slopes", "f8", (count, SLOPE_WEIGHTS)) for name, count in zip(OFFSETS, counts, strict=True)),
        ("edges", EDGE, (*counts, phase_steps)),
        ("potentials", NODE, over_nodes),
        ("centroids", NODE, over_nodes if has_centroid else (0,)),
        *([("coast", coast)] if coast is not None else []),
        *([("teeth", teeth)] if teeth is not None else []),
    )
