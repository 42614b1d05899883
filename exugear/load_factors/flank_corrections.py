"""Flank corrections that even out the load over the face under a load: helix slope and crowning of the pinions."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import xarray as xr

from exugear.gearbox.constant_loads import given_loads, words_of
from exugear.gearbox.gearbox import Gearbox
from exugear.load_factors.elastic_statics import FaceMesh, elastic_train
from exugear.load_factors.load_distribution import (
    PARTS,
    PHASES,
    Solution,
    axis_of_pair,
    by_contact,
    by_springs,
    face_load_factor,
    given_stiffness,
    members_of_planets,
)
from exugear.multibody.model import Model
from fem.contact.resolution import Resolution
from fem.gear.gear import Gear
from fem.microgeometry.flank import Sides
from fem.microgeometry.modification import HelixSlope, LeadCrowning
from fem.pair.pair import GearPair
from fem.support.arguments import Finite, checked
from fem.support.progress import shown
from fem.support.validation import require, require_kind
from fem.units import um

__all__ = ["FlankCorrections", "propose_flank_corrections"]

#: Corrections of the corrections, and the change of an amount [m] at which they end.
ROUNDS, SMALLEST = 12, 0.005 * um
#: Largest spread of the gap over the face by manufacture [m].
LARGEST_SPREAD = 1e-3
MISSING = "lead modifications need a fem.GearPair"


@checked
@dataclass(frozen=True)
class FlankCorrections:
    """Corrections of the pinions' loaded flanks, by label of the stage.

    corrections   (`fem.HelixSlope`, `fem.LeadCrowning`) in the axes of the pair, to be added to the pinion's flank
    pairs         the pairs with these corrections
    table         Dataset over `mesh`: C_Hbeta and C_beta [m], K_H_beta before and with the corrections (state)
    """

    corrections: Mapping[str, tuple[HelixSlope, LeadCrowning]]
    pairs: Mapping[str, GearPair]
    table: xr.Dataset

    def __repr__(self) -> str:
        lines = [
            f"{label}: {parts}, K_H_beta {before:.3f} -> {after:.3f}"
            for (label, parts), (before, after) in zip(
                self.corrections.items(), self.table["K_H_beta"].values, strict=True
            )
        ]
        return "\n".join(lines)


@checked
def propose_flank_corrections(
    gearbox: Gearbox | Model,
    load: Finite | None = None,
    *,
    loads: Mapping[str, float] | None = None,
    spread: Finite = 0.0,
    mesh_stiffness: Finite | Mapping[str, float] | None = None,
    parts: int = PARTS,
    phases: int = PHASES,
    resolution: Resolution | None = None,
    progress: bool = True,
) -> FlankCorrections:
    """Helix slope and lead crowning of the pinions with which the load under a torque is even over the face.

    spread   by which the gap over the face varies from gearbox to gearbox [m], either way, by manufacture: half of it
             is added as crowning (after ISO 6336-1, annex B), which costs some evenness under the mean gap

    The other arguments as for `exugear.load_distribution`. The slope takes the mean slope of the gap by shafts,
    bearings and present lead modifications, the crowning its curvature (< 0: hollow, where the ends of the face carry
    too little). Both are iterated, as an even load bends shafts otherwise. They hold for this load; under less they
    leave the face uneven the other way: look at `load_distribution` over the duty cycle. Meshes of planets with the
    same sun, or with the same ring, have a common correction, that of the sun or of the planets' flanks to the ring:
    the mean of what each takes, so that what differs from planet to planet, as pins that lean, is left.

    Raises as `exugear.load_distribution`, and ValueError for a stage with a `RingPair`.
    """
    box = gearbox.gearbox if isinstance(gearbox, Model) else gearbox
    resolution = Resolution() if resolution is None else resolution
    require_kind("resolution", resolution, Resolution)
    within = f"spread must lie in [0, {LARGEST_SPREAD:g}] m, got {spread:g}; pass metres: 10*um"
    require(0 <= spread <= LARGEST_SPREAD, within)
    ringed = [x for x, stage in zip(box.labels, box.stages, strict=True) if not isinstance(stage.pair, GearPair)]
    require(not ringed, f"stages {ringed} have a RingPair; {MISSING}")
    torques = given_loads(box, load, loads)
    train, members = elastic_train(box, torques, parts), members_of_planets(box)
    stiffness = given_stiffness(box, train, mesh_stiffness)

    def solved(amounts: np.ndarray) -> Solution:
        corrected = [_with(mesh, _parts(*row)) for mesh, row in zip(train.meshes, amounts.tolist(), strict=True)]
        springs = by_springs(replace(train, meshes=corrected), stiffness)
        return springs if mesh_stiffness is not None else by_contact(springs, phases, resolution)

    with shown(progress):
        amounts = np.zeros((len(train.meshes), 2))
        before = after = solved(amounts)
        for _ in range(ROUNDS):
            steps = np.array(
                [_remainder(*each) for each in zip(after.train.meshes, after.gaps, after.forces, strict=True)]
            )
            steps = _common_to_planets(steps, members)
            amounts = amounts + steps
            after = solved(amounts)
            if np.abs(steps).max() < SMALLEST:
                break
        amounts[:, 1] += spread / 2
        after = solved(amounts) if spread else after
    constant = mesh_stiffness is not None
    factors = [[face_load_factor(x, at_ends=constant) for x in state.line_loads] for state in (before, after)]
    corrections = {label: _parts(*row) for label, row in zip(box.labels, amounts.tolist(), strict=True)}
    pairs: Any = {
        label: _with(mesh, corrections[label]).pair for label, mesh in zip(box.labels, train.meshes, strict=True)
    }
    table = _table(box, amounts, np.array(factors).T)
    return FlankCorrections(corrections, pairs, table.assign_attrs({"load": words_of(box, torques)}))


def _parts(C_Hbeta: float, C_beta: float) -> tuple[HelixSlope, LeadCrowning]:
    return HelixSlope(C_Hbeta), LeadCrowning(C_beta)


def _common_to_planets(steps: np.ndarray, members: Sequence[str]) -> np.ndarray:
    """(n_mesh, 2) amounts of which planets with the same sun or ring have the mean."""
    common = steps.copy()
    for member in {name for name in members if name}:
        chosen = [name == member for name in members]
        common[chosen] = steps[chosen].mean(axis=0)
    return common


def _remainder(mesh: FaceMesh, gap: np.ndarray, force: float) -> tuple[float, float]:
    """Helix slope and crowning [m] of the pinion that take slope and curvature of a gap; 0 without load."""
    if not force:
        return 0.0, 0.0
    z, b = axis_of_pair(mesh), mesh.pair.pinion.b
    curvature, slope, _ = np.polyfit(z * mesh.axial, gap, 2)
    return float(-slope * b), float(-curvature * b**2 / 4)


def _with(mesh: FaceMesh, parts: Sequence[Any]) -> FaceMesh:
    """The mesh with further modifications of the loaded flank of its pinion."""
    pair: Any = mesh.pair
    pinion: Gear = pair.pinion
    left, right = pinion.drive_flank, pinion.coast_flank
    flank: Any = Sides((*left, *parts), right) if mesh.side > 0 else Sides(left, (*right, *parts))
    corrected = GearPair(replace(pinion, flank=flank), pair.wheel, a=pair.a)
    return replace(mesh, pair=corrected)


def _table(box: Gearbox, amounts: np.ndarray, factors: np.ndarray) -> xr.Dataset:
    about = (
        {"units": "m", "long_name": "helix slope of the pinion"},
        {"units": "m", "long_name": "crowning of the pinion"},
    )
    factor = {"units": "1", "long_name": "face load factor"}
    return xr.Dataset(
        {
            "C_Hbeta": ("mesh", amounts[:, 0], about[0]),
            "C_beta": ("mesh", amounts[:, 1], about[1]),
            "K_H_beta": (("mesh", "state"), factors, factor),
        },
        {"mesh": [*box.labels], "state": ["before", "corrected"]},
        {"title": "flank corrections"},
    )
