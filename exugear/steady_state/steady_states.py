"""Steady states of a gearbox over the speed."""

from collections.abc import Sequence
from typing import Annotated

import numpy as np
import xarray as xr

from exugear.operation.train_motion import HIGHEST_SPEED
from exugear.steady_state.branch_data import labelled
from exugear.steady_state.branch_search import all_branches
from exugear.steady_state.continuation import Range
from exugear.steady_state.gearbox_reduction import check_reducible, steady_system
from exugear.system.model import Model
from fem.support.arguments import checked
from fem.support.validation import numbers, require, require_within, text_of

#: Resonance of the mesh over the lowest mesh frequency: below, the DTE is the STE but for its vibration after jumps.
SLOWEST = 32
#: Multiples of the mesh frequency up to which harmonics are given, at most.
MOST_HARMONICS = 100
DRIVES = "held", "free"
#: Relative variation of the stiffness of another mesh above which it excites; difference of equal mesh frequencies.
LEAST_VARIATION, SAME_FREQUENCY = 1e-3, 1e-9


def check_range(name: str, value) -> None:
    """ValueError unless the value holds two rising speeds."""
    ends = numbers(name, value)
    in_range = ends.shape == (2,) and 0 <= ends[0] < ends[1] < HIGHEST_SPEED
    limits = f"0 <= lowest < highest < {HIGHEST_SPEED:g} rad/s"
    require(bool(in_range), f"{name} must be (lowest, highest) with {limits}, got {text_of(value)}")


@checked
def steady_states(
    model: Model,
    speed: Annotated[Sequence[float], check_range],
    load: float,
    *,
    stage: int = 0,
    drive: str = "held",
    harmonics: int = 10,
) -> xr.Dataset:
    """All periodic steady states of a gearbox over a range of speed, unstable ones included.

    speed       lowest and highest speed of the driving shaft [rad/s]; the lowest is raised to the speed at which the
                mesh frequency is 1/32 of the resonance of the mesh (attribute "lowest_speed")
    load        constant torque on the driven shaft against its motion at positive speed [N m]
    stage       number of the stage whose mesh excites the gearbox
    drive       "held": the driving shaft turns at constant speed; "free": under a constant torque
    harmonics   multiples of the mesh frequency up to which harmonics of the DTE are given

    The equations are those of a run: the force law of the stage with its damping, contact loss and back flank. All else
    is linear about the equilibrium under the load (`exugear.steady_state.gearbox_reduction`): exact for shafts that
    spin with a single stage. The other meshes have their mean stiffness and excite nothing; the attribute
    "variation_of_other_meshes" is half the range of their stiffness over its mean.

    Returns a Dataset over `point`, along each `branch`: speed [rad/s], mesh_frequency [Hz], mean, rms, peak_to_peak [m]
    of the DTE, harmonics (point, harmonic) [m] with harmonic_phase [rad], smallest_force, largest_force [N],
    share_without_contact, period (1 or 2 mesh cycles), stable, largest_multiplier, bifurcation ("fold", "period
    doubling" or ""). Orbits of one mesh cycle, and isolated ones of two, are reached by sweeps over the speed up and
    down, the others by continuation. `exugear.plots.plot_branches` draws them.

    Raises ValueError for input out of range, for friction and drag, for stages with the same mesh frequency as beside
    an idler, and for loads beyond the maps; RuntimeError where no periodic orbit is reached.

    Source: Seydel, Practical bifurcation and stability analysis, 3rd ed. (2010): shooting, continuation by arc length.
    """
    low, high = speed
    number = len(model.meshes)
    require(0 <= stage < number, f"stage must be a number from 0 to {number - 1}, got {stage}")
    require(drive in DRIVES, f"drive must be one of {DRIVES}, got {drive!r}")
    require_within("harmonics", harmonics, 1, MOST_HARMONICS, remedy="multiples of the mesh frequency")
    check_reducible(model)
    cycles = float(model.mesh_cycles[stage])
    system = steady_system(model, load, stage, speed=(low + high) / 2, drive=drive)
    _check_alone(model, stage, system.variation)
    lowest = max(low, system.resonance / SLOWEST / cycles)
    reached = f"speed must reach beyond {lowest:.4g} rad/s, where the mesh frequency is 1/{SLOWEST} of the resonance"
    require(lowest < high, f"{reached}, got {speed}; below it the DTE is the STE")
    within = Range(lowest * cycles / system.resonance, high * cycles / system.resonance)
    branches = all_branches(system, within)
    broken = [number for number, branch in enumerate(branches) if not branch.complete]
    about = {"stage": model.gearbox.labels[stage], "load": load, "drive": drive, "lowest_speed": lowest}
    about |= {"resonance": system.resonance, "static_deflection": system.static_deflection}
    about |= {"variation_of_other_meshes": system.variation, "broken_branches": broken}
    return labelled(system, branches, cycles, harmonics).assign_attrs(about)


def _check_alone(model: Model, stage: int, variation: float) -> None:
    """Require that no other stage whose stiffness varies has the mesh frequency of a stage."""
    frequencies = np.delete(model.mesh_cycles, stage) / model.mesh_cycles[stage]
    shared = variation > LEAST_VARIATION and bool((np.abs(frequencies - 1) < SAME_FREQUENCY).any())
    both = "as with an idler: both excite the gearbox together, which is not considered"
    require(not shared, f"stage must not share its mesh frequency with a stage of varying stiffness, {both}")
