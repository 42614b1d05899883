"""The flanks of a gear: sums of modifications and deviations as metres of material removed, on one or on each side."""

import json
from collections.abc import Iterable
from dataclasses import asdict, dataclass

import numpy as np

from fem.microgeometry.deviation import Grid, PitchDeviation
from fem.microgeometry.modification import (
    MM,
    EdgeBreak,
    EndRelief,
    FlankExtent,
    HelixSlope,
    LeadCrowning,
    Modification,
    ProfileCrowning,
    RootRelief,
    TipRelief,
)
from fem.support.representation import short
from fem.support.validation import told

DESIGNED = (TipRelief, RootRelief, ProfileCrowning, LeadCrowning, HelixSlope, EndRelief, EdgeBreak)
KINDS = {kind.__name__: kind for kind in (*DESIGNED, PitchDeviation, Grid)}
Flank = tuple[Modification, ...]
#: Added material may rise by this much per length of profile.
STEEPEST = 0.3
PLACES = 201


def parts_of(flank, name: str = "flank") -> Flank:
    """The modifications as a tuple; ValueError for what is none."""
    parts = tuple(flank) if isinstance(flank, Iterable) else (flank,)
    if not all(hasattr(part, "removed") and not isinstance(part, type) for part in parts):
        raise ValueError(f"{name} must hold modifications such as fem.TipRelief(15*um, 2.5*mm), got {told(flank)}")
    return parts


@short()
@dataclass(frozen=True)
class Sides:
    """Modifications of left and right flanks (ISO 21771).

    Seen from positive z with the tooth pointing up, the left flank faces counter-clockwise. It is the one that carries
    the load, on pinion and wheel, while the pinion drives counter-clockwise.

    A map is of the left flanks; the right ones are checked and kept, but change nothing. For theirs map the pair as a
    mirror shows it: both gears with left and right exchanged and beta of opposite sign, and of pitch deviations
    values[-k] for tooth k of the pinion, values[1 - k] of the wheel; all else stays, but for the sign of
    `Offsets.f_sigma_beta`. Phases of that map are `GearPair.back_phase` minus those of the left flanks.
    """

    left: Flank = ()
    right: Flank = ()

    def __post_init__(self):
        object.__setattr__(self, "left", parts_of(self.left, "left flank"))
        object.__setattr__(self, "right", parts_of(self.right, "right flank"))


def removed(flank: Flank, face: FlankExtent, roll, axial, *, tooth: int | np.ndarray = 0) -> np.ndarray:
    """Sum of all modifications of a tooth, or of each of several [m], broadcast over roll, axial [m] and teeth.

    Beyond root form and tip, where there is no flank, as at these ends: a power law goes on to millimetres there.
    """
    roll, axial = np.asarray(roll, float), np.asarray(axial, float)
    found = np.zeros(np.broadcast_shapes(roll.shape, axial.shape))
    if not flank:
        return found
    face, roll = face._replace(tooth=tooth), np.minimum(np.maximum(roll, face.roll_form), face.roll_tip)
    for part in flank:
        found = found + part.removed(face, roll, axial)
    return found


def pitch_deviations(flank: Flank) -> tuple[PitchDeviation, ...]:
    """Those of a flank's modifications that turn the whole flank of a tooth."""
    return tuple(part for part in flank if isinstance(part, PitchDeviation))


def alike(flank: Flank) -> bool:
    """Whether all teeth have the same flank."""
    return all(len(set(part.values)) == 1 for part in pitch_deviations(flank))


def edges(flank: Flank, face: FlankExtent) -> list[float]:
    """Roll lengths where the slope of a modification jumps [m]."""
    return [edge for part in flank if hasattr(part, "edges") for edge in part.edges(face)]


def edges_across(flank: Flank, face: FlankExtent) -> list[float]:
    """Axial places where the slope of a modification jumps [m]."""
    return [edge for part in flank if hasattr(part, "edges_across") for edge in part.edges_across(face)]


def lines_across(flank: Flank, face: FlankExtent) -> list[float]:
    """Axial places where what a modification adds may be highest [m], of those with many lines across the width."""
    return [line for part in flank if hasattr(part, "lines_across") for line in part.lines_across(face)]


def roundings(flank: Flank) -> Flank:
    """Those of a flank's modifications that round its tip edge."""
    return tuple(part for part in flank if hasattr(part, "rounding"))


def without_roundings(flank: Flank) -> Flank:
    """The others."""
    return tuple(part for part in flank if not hasattr(part, "rounding"))


def rounding(flank: Flank, face: FlankExtent) -> tuple[float, float]:
    """Roll length where the tip edge begins, and the radius of its `EdgeBreak` [m]; a sharp one: the tip's, and 0."""
    edges = [part.rounding(face) for part in flank if hasattr(part, "rounding")]
    return min(edges, default=(face.roll_tip, 0.0))


def check(flank: Flank, face: FlankExtent) -> None:
    """ValueError unless all modifications suit the face, and leave it a flank."""
    for part in flank:
        if hasattr(part, "check"):
            part.check(face)
        _check_added(part, face)


def _check_added(part: Modification, face: FlankExtent) -> None:
    """Near the base circle profiles are short: a little material added there is a spike."""
    roll = np.linspace(face.roll_form, face.roll_tip, PLACES)
    added = -part.removed(face, roll[:, None], np.array([-0.5, 0.0, 0.5]) * face.width)
    rise = np.abs(np.diff(added, axis=0) / np.diff(roll**2 / (2 * face.r_b))[:, None])
    steep = np.where(np.maximum(added[1:], added[:-1]) > 0, rise, 0.0).max(axis=1)
    if steep.max() > STEEPEST:
        place = roll[np.argmax(steep)] / MM
        cause = f"{part} adds {steep.max():.2g} m per metre of profile at roll length {place:.3g} mm"
        raise ValueError(f"{cause}; at most {STEEPEST}: make it longer, or let the flank begin farther out")


def _listed(flank: Flank) -> list[dict]:
    return [{"kind": type(part).__name__} | asdict(part) for part in flank]  # type: ignore[call-overload]


def to_text(flank: Flank | Sides) -> str:
    """The modifications as JSON, for the attributes of a file; `from_text` reads them back."""
    if isinstance(flank, Sides):
        return json.dumps({"left": _listed(flank.left), "right": _listed(flank.right)})
    return json.dumps(_listed(flank))


def _made(parts: list[dict]) -> Flank:
    unknown = [part["kind"] for part in parts if part["kind"] not in KINDS]
    if unknown:
        raise ValueError(f"unknown flank modifications {unknown}; known are {list(KINDS)}")
    return tuple(KINDS[part["kind"]](**{k: v for k, v in part.items() if k != "kind"}) for part in parts)


def from_text(text: str) -> Flank | Sides:
    """The modifications that `to_text` wrote; ValueError for a kind that is none."""
    data = json.loads(text)
    if isinstance(data, dict):
        return Sides(_made(data["left"]), _made(data["right"]))
    return _made(data)
