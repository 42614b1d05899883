"""The flanks of a gear: sums of modifications and deviations, the material removed [m] from each side."""

import json
from collections.abc import Iterable
from dataclasses import asdict, dataclass

import numpy as np

from fem.microgeometry.deviation import Crack, Grid, OnTooth, PitchDeviation, Spall, Waviness
from fem.microgeometry.modification import DESIGNED, FlankExtent, Modification
from fem.support.representation import short
from fem.support.validation import require, set_fields, text_of
from fem.units import mm

KINDS = {kind.__name__: kind for kind in (*DESIGNED, PitchDeviation, Grid, Spall, Waviness, Crack, OnTooth)}
Flank = tuple[Modification, ...]
#: Largest slope over the profile length of material that a modification adds.
STEEPEST = 0.3
#: Roll lengths at which that slope is checked.
CHECKED_ROLLS = 201


def parts_of(flank, name: str = "flank") -> Flank:
    """The modifications as a tuple; ValueError for an object that is no modification."""
    parts = tuple(flank) if isinstance(flank, Iterable) else (flank,)
    if not all(hasattr(part, "removed") and not isinstance(part, type) for part in parts):
        raise ValueError(f"{name} must hold modifications such as fem.TipRelief(15*um, 2.5*mm), got {text_of(flank)}")
    return parts


@short()
@dataclass(frozen=True)
class Sides:
    """Modifications of left and right flanks (ISO 21771).

    Seen from positive z with the tooth pointing up, the left flank faces counter-clockwise. The left flanks of pinion
    and wheel carry the load while the pinion drives counter-clockwise.

    Torques > 0 of a map load the left flanks, torques < 0 the right ones. Other functions take the left flanks: pass
    them the mirror image of the pair, `fem.mirror_image`.

    Raises ValueError for parts that are no modifications.
    """

    left: Flank = ()
    right: Flank = ()

    def __post_init__(self):
        set_fields(self, left=parts_of(self.left, "left flank"), right=parts_of(self.right, "right flank"))


def removed(flank: Flank, face: FlankExtent, roll, axial, *, tooth: int | np.ndarray = 0) -> np.ndarray:
    """Sum of all modifications [m] at roll lengths and axial positions [m] of teeth, broadcast.

    Beyond root form and tip circle, where there is no flank, the values on these circles continue: extrapolated power
    laws would reach millimetres.
    """
    roll, axial = np.asarray(roll, float), np.asarray(axial, float)
    total = np.zeros(np.broadcast_shapes(roll.shape, axial.shape))
    if not flank:
        return total
    face, roll = face._replace(tooth=tooth), np.minimum(np.maximum(roll, face.roll_form), face.roll_tip)
    for part in flank:
        total = total + part.removed(face, roll, axial)
    return total


def pitch_deviations(flank: Flank) -> tuple[PitchDeviation, ...]:
    """The pitch deviations among the modifications of a flank, which turn whole flanks."""
    return tuple(part for part in flank if isinstance(part, PitchDeviation))


def names_teeth(flank: Flank) -> bool:
    """Whether any modification counts the teeth, so that phases count all pitches."""
    return any(hasattr(part, "taken_from") for part in flank)


def equal_on_all_teeth(flank: Flank) -> bool:
    """Whether all teeth have the same flank."""
    return not any(getattr(part, "differs", False) for part in flank)


def alike_on_all_teeth(flank: Flank) -> Flank:
    """The modifications that do not count the teeth."""
    return tuple(part for part in flank if not hasattr(part, "taken_from"))


def of_single_tooth(flank: Flank, tooth: int, z: int) -> Flank:
    """The modifications of a tooth but its pitch deviation, as those of tooth 0."""
    parts = [part for part in flank if not isinstance(part, PitchDeviation)]
    shifted = [part.taken_from(tooth, 1, z) if hasattr(part, "taken_from") else part for part in parts]
    return tuple(part for part in shifted if not isinstance(part, OnTooth) or part.tooth == 0)


def unlike_teeth(flank: Flank) -> list[int]:
    """Tooth 0, and the teeth that have modifications of their own."""
    return sorted({0, *(part.tooth for part in flank if isinstance(part, OnTooth))})


def edges(flank: Flank, face: FlankExtent) -> list[float]:
    """Roll lengths where the slope of a modification jumps [m]."""
    return [edge for part in flank if hasattr(part, "edges") for edge in part.edges(face)]


def edges_across(flank: Flank, face: FlankExtent) -> list[float]:
    """Axial positions where the slope of a modification jumps [m]."""
    return [edge for part in flank if hasattr(part, "edges_across") for edge in part.edges_across(face)]


def lines_across(flank: Flank, face: FlankExtent) -> list[float]:
    """Axial grid lines of modifications with many of them [m]: added material may be highest there."""
    return [line for part in flank if hasattr(part, "lines_across") for line in part.lines_across(face)]


def rounding(flank: Flank, face: FlankExtent) -> tuple[float, float]:
    """Roll length where the rounding of the tip edge begins, and its radius [m]; the tip and 0 if sharp."""
    edges = [part.rounding(face) for part in flank if hasattr(part, "rounding")]
    return min(edges, default=(face.roll_tip, 0.0))


def check(flank: Flank, face: FlankExtent) -> None:
    """ValueError unless all modifications suit the flank."""
    for part in flank:
        if hasattr(part, "check"):
            part.check(face)
        _check_added(part, face)


def _check_added(part: Modification, face: FlankExtent) -> None:
    """ValueError for added material that rises steeply: near the base circle, where the profile is short, a spike."""
    roll = np.linspace(face.roll_form, face.roll_tip, CHECKED_ROLLS)
    added = -part.removed(face, roll[:, None], np.array([-0.5, 0.0, 0.5]) * face.width)
    require(
        bool(np.isfinite(added).all()), f"{part} removes material that is not finite; removed(...) must return metres"
    )
    rise = np.abs(np.diff(added, axis=0) / np.diff(roll**2 / (2 * face.r_b))[:, None])
    steep = np.where(np.maximum(added[1:], added[:-1]) > 0, rise, 0.0).max(axis=1)
    if steep.max() > STEEPEST:
        steepest = roll[np.argmax(steep)] / mm
        cause = f"{part} adds {steep.max():.2g} m per metre of profile at roll length {steepest:.3g} mm"
        raise ValueError(f"{cause}; at most {STEEPEST}: make it longer, or let the flank begin farther out")


def _listed(flank: Flank) -> list[dict]:
    return [{"kind": type(part).__name__} | _fields(part) for part in flank]


def _fields(part) -> dict:
    if isinstance(part, OnTooth):
        return {"tooth": part.tooth, "flank": _listed(part.flank)}
    return asdict(part)


def to_text(flank: Flank | Sides) -> str:
    """The modifications as JSON, for the attributes of a file; `from_text` reads them back.

    ValueError unless they are dataclasses of numbers, texts and lists.
    """
    try:
        if isinstance(flank, Sides):
            return json.dumps({"left": _listed(flank.left), "right": _listed(flank.right)})
        return json.dumps(_listed(flank))
    except TypeError as error:
        remedy = "let its modifications be dataclasses of numbers, texts and lists"
        raise ValueError(f"flank cannot be stored with a map ({error}); {remedy}") from None


def _from_list(parts: list[dict]) -> Flank:
    unknown = [part["kind"] for part in parts if part["kind"] not in KINDS]
    if unknown:
        raise ValueError(f"unknown flank modifications {unknown}; known are {list(KINDS)}")
    return tuple(KINDS[part["kind"]](**_arguments(part)) for part in parts)


def _arguments(part: dict) -> dict:
    """Arguments of a modification; the flank of a single tooth holds further ones."""
    arguments = {name: value for name, value in part.items() if name != "kind"}
    return arguments | ({"flank": _from_list(part["flank"])} if part["kind"] == "OnTooth" else {})


def from_text(text: str) -> Flank | Sides:
    """The modifications that `to_text` wrote; ValueError for an unknown kind."""
    data = json.loads(text)
    if isinstance(data, dict):
        return Sides(_from_list(data["left"]), _from_list(data["right"]))
    return _from_list(data)
