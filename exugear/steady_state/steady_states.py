"""Steady states of a gearbox over the speed."""

from collections.abc import Mapping, Sequence
from math import nan
from typing import Annotated, Any

import numpy as np
import xarray as xr

from exugear.gearbox.constant_loads import given_loads, idle_stages
from exugear.gearbox.stage import stage_number
from exugear.modal.modes import load_attributes
from exugear.multibody.equilibrium import jammed
from exugear.multibody.model import Model, require_model
from exugear.multibody.turns import in_turn
from exugear.operation.train_motion import HIGHEST_SPEED
from exugear.steady_state.bearing_vibration import bearing_vibration
from exugear.steady_state.branch import Branch
from exugear.steady_state.branch_data import labelled
from exugear.steady_state.branch_search import all_branches
from exugear.steady_state.continuation import Range
from exugear.steady_state.force_error import Reduction, force_error
from exugear.steady_state.gearbox_reduction import check_reducible, exciting_stages, reduced
from exugear.steady_state.periodic_orbit import PeriodicOrbits
from fem.support.arguments import checked, keywords_after_first
from fem.support.progress import shown
from fem.support.validation import numbers, require, require_within, text_of

#: Resonance of the mesh over the lowest mesh frequency: below, the DTE is the STE but for its vibration after jumps.
SLOWEST = 32
#: Multiples of the mesh frequency up to which harmonics are given, at most.
MOST_HARMONICS = 100
DRIVES = "held", "free"


def check_range(name: str, value) -> None:
    """ValueError unless the value holds two rising speeds."""
    ends = numbers(name, value)
    in_range = ends.shape == (2,) and 0 <= ends[0] < ends[1] < HIGHEST_SPEED
    limits = f"0 <= lowest < highest < {HIGHEST_SPEED:g} rad/s"
    require(bool(in_range), f"{name} must be (lowest, highest) with {limits}, got {text_of(value)}")


def check_stages(name: str, value) -> None:
    """ValueError unless the value is a number or a label of a stage, or holds different ones."""
    labels = [value] if isinstance(value, str) else value
    if isinstance(labels, list | tuple) and labels and all(isinstance(label, str) for label in labels):
        require(len(set(labels)) == len(labels), f"{name} must hold distinct labels of stages, got {text_of(value)}")
        return
    stages = numbers(name, value)
    whole = stages.ndim <= 1 and stages.size > 0 and (stages == np.floor(stages)).all() and (stages >= 0).all()
    different = np.unique(stages).size == stages.size
    kinds = f"{name} must be a stage number >= 0 or label, or several distinct ones such as (0, 1)"
    kinds = f"{kinds}, got {text_of(value)}"
    require(bool(whole and different), kinds)


@keywords_after_first("speed", "load")
@checked
@in_turn
def steady_states(
    model: Model,
    *,
    speed: Annotated[Sequence[float], check_range],
    load: float | None = None,
    loads: Mapping[str, float] | None = None,
    stage: Annotated[int | str | Sequence[int] | Sequence[str], check_stages] = 0,
    drive: str = "held",
    harmonics: int = 10,
    bearing_forces: bool = False,
    progress: bool = True,
) -> xr.Dataset:
    """All periodic steady states of a gearbox over a range of speed, unstable ones included.

    speed       lowest and highest speed of the driving shaft [rad/s]; the lowest is raised to the speed at which the
                mesh frequency is 1/32 of the resonance of the mesh (attribute "lowest_speed")
    load        constant torque on the driven shaft against its motion at positive speed [N m]
    loads       instead, of a gearbox with several outputs: name of a shaft -> constant torque against its motion [N m]
    stage       number or label of the stage whose mesh excites the gearbox, or several whose meshes excite it
                together; stages with the same mesh frequency, as beside an idler, excite it as well
    drive       "held": the driving shaft turns at constant speed; "free": under a constant torque
    harmonics   multiples of the mesh frequency up to which harmonics of the DTE are given
    bearing_forces  whether "bearing_force_rms" (point, bearing, direction) [N] is given, the rms of the vibration of
                the forces of bearings on rigid shafts
    progress    show bars with the time left

    The equations are those of a run: the force laws of these stages with their damping, contact loss and back flanks.
    All else is linear about the equilibrium under the load (`exugear.steady_state.gearbox_reduction`): exact for shafts
    that spin if all stages excite. The further meshes have their mean stiffness; the attribute
    "variation_of_other_meshes" is half the range of their stiffness over its mean. Meshes that carry nothing stay open
    (attribute "idle_stages"). Stages of different mesh frequencies
    repeat only after a common period (attribute "common_period" in mesh cycles of the first), on which the time of
    computing depends: a revolution of the shaft between two stages, for most numbers of teeth. Branches that enter the
    range from the resonance are then searched only if the range holds it.

    The meshes of a planetary set share their mesh frequency and excite together, each at its phase, also where two
    members are driven: speeds keep the ratio of `Gearbox(speeds=)`. Planets on elastic pins, in the plane and in space,
    are seen in the frame that turns with their carrier, with gyroscopic terms and centrifugal forces. There bearings
    and housing must be the same in x and y, the housing without mass, and all else must only spin. A ring with modes
    (`Planetary(ring_modes=)`) is passed by the planets: the common period is a turn of them around it, with a mesh
    cycle for each of its teeth.

    The attribute "force_error" compares the mesh forces at the motion with those of the whole laws: the largest rms of
    the difference over the period, over the mean force, among the largest orbits of the branches;
    "share_of_modes_left_out" is the largest in the compliance or the mobility of a mesh.

    Returns a Dataset over `point`, along each `branch`: speed [rad/s], mesh_frequency [Hz], mean, rms, peak_to_peak [m]
    of the DTE, harmonics (point, harmonic) [m] with harmonic_phase [rad], smallest_force, largest_force [N],
    share_without_contact, torque_harmonics (point, shaft, harmonic) [N m] of the exciting meshes, period (1 or 2 common
    periods), stable, largest_multiplier, bifurcation ("fold", "period doubling" or ""). Values of a mesh have a further
    dimension `stage` where several numbers are given. Orbits of one period, and isolated ones of two, are reached by
    sweeps over the speed up and down, the others by continuation.
    `exugear.plots.plot_branches` draws them.

    Raises ValueError for input out of range, for friction and drag, for stages without a common period or that are
    idle, and for loads beyond the maps, also where all motions leave them; RuntimeError where a mode that the
    meshes excite is not damped, or no periodic orbit is reached otherwise.

    Source: Seydel, Practical bifurcation and stability analysis, 3rd ed. (2010): shooting, continuation by arc length.
    """
    require_model(model)
    low, high = speed
    given = [stage_number(model.gearbox.labels, each) for each in np.atleast_1d(stage).tolist()]
    require(drive in DRIVES, f"drive must be one of {DRIVES}, got {drive!r}")
    require_within("harmonics", harmonics, 1, MOST_HARMONICS, remedy="multiples of the mesh frequency")
    check_reducible(model)
    torques = given_loads(model.gearbox, load, loads)
    idle = idle_stages(model.gearbox, torques)
    stages = exciting_stages(model, given, idle)
    cycles = model.mesh_cycles[stages]
    reduction = reduced(model, torques, stages, speed=(low + high) / 2, drive=drive)
    _check_thrown_planets(model, reduction, high)
    system = reduction.system
    lowest = max(low, system.resonance / SLOWEST / cycles[0])
    reached = f"speed must reach beyond {lowest:.4g} rad/s, where the mesh frequency is 1/{SLOWEST} of the resonance"
    require(lowest < high, f"{reached}, got {speed}; below it the DTE is the STE")
    within = Range(lowest * cycles[0] / system.resonance, high * cycles[0] / system.resonance)
    with shown(progress):
        branches = all_branches(system, within)
    levers = _levers(model, reduction)
    data = labelled(system, branches, cycles[: len(given)], harmonics, levers)
    if bearing_forces:
        vibration = bearing_vibration(model, reduction, branches)
        data = data.assign_coords({name: vibration.pop(name) for name in ("bearing", "direction")}).assign(vibration)
    about = load_attributes(load, torques) | {"drive": drive, "idle_stages": idle, "lowest_speed": float(lowest)}
    about |= _about(model, reduction, branches)
    if np.ndim(stage):
        return data.assign_coords(stage=[model.gearbox.labels[i] for i in given]).assign_attrs(about)
    return data.isel(stage=0).assign_attrs({"stage": model.gearbox.labels[given[0]], **about})


def _check_thrown_planets(model: Model, reduction: Reduction, speed: float) -> None:
    """ValueError where planets are thrown so far outwards that a tooth would touch both flanks of its gap.

    speed   highest one of the driving shaft [rad/s]
    """
    thrown = reduction.system.blocks.rest_at(speed)
    if not thrown.any():
        return
    q = reduction.coordinates + reduction.motions[:, : thrown.size] @ thrown
    cause = jammed(model, q)
    require(not cause, f"speed: at {speed:.4g} rad/s planets are thrown outwards: {cause}")


def _levers(model: Model, reduction: Reduction) -> dict[str, np.ndarray]:
    """Of each shaft that meshes turn: (n_mesh,) torque about its axis per force of the meshes that excite [m]."""
    rows = np.array([model.meshes[stage].row for stage in reduction.stages])
    return {name: -rows[:, spin] for name, spin in model.spins.items() if rows[:, spin].any()}


def _about(model: Model, reduction: Reduction, branches: Sequence[Branch]) -> dict[str, Any]:
    """Attributes of the data: what excites, in which units amplitudes are large, what was left out, and its effect."""
    system = reduction.system
    return {
        "exciting_stages": [model.gearbox.labels[i] for i in reduction.stages],
        "common_period": system.cycles,
        "resonance": system.resonance,
        "static_deflection": system.static_deflection,
        "variation_of_other_meshes": system.variation,
        "share_of_modes_left_out": system.blocks.left_out,
        "force_error": float(np.fmax.reduce([_force_error_of(model, reduction, branch) for branch in branches])),
        "broken_branches": [number for number, branch in enumerate(branches) if not branch.complete],
    }


def _force_error_of(model: Model, reduction: Reduction, branch: Branch) -> float:
    """`force_error` of the largest orbit of a branch whose samples stay within the maps; NaN if none does."""
    orbits = PeriodicOrbits(reduction.system, branch.period)
    for point in sorted(branch.points, key=lambda point: -float(np.abs(point.unknowns[:-1]).max())):
        try:
            return force_error(model, reduction, orbits.states_of(point.unknowns), orbits.frequency_of(point.unknowns))
        except ValueError:
            continue
    return nan
