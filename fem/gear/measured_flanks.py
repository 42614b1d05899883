"""Measured deviations of flanks from tables with units in their header: pitch charts, traces and topographies."""

from math import pi

import numpy as np

from fem.gear.gear import Gear
from fem.microgeometry.deviation import Grid, OnTooth, PitchDeviation
from fem.microgeometry.modification import LARGEST_AMOUNT, HelixSlope
from fem.support.arguments import FilePath, Finite, checked
from fem.support.tables import read_grid, read_table
from fem.support.validation import require
from fem.units import um

#: Largest sum of all single pitch deviations of a gear [m], which is 0 but for rounding.
LARGEST_CLOSING_ERROR = 2 * um


@checked
def pitch_chart(path: FilePath, gear: Gear) -> PitchDeviation:
    """Pitch deviations of a table with a line for each tooth, under the header tooth [1] and one of these columns.

    removed [um]        material removed from the whole flank of the tooth
    single_pitch [um]   deviation of the pitch from the tooth before it: > 0, a pitch that is too long, moves the left
                        flank ahead, which adds material to it. Their sum around the gear is 0

    path    text file; teeth are numbered from 0 or from 1 on, counter-clockwise, of an internal gear clockwise

    Raises FileNotFoundError, and ValueError with the line of the file and a remedy for a unit that is missing or
    unknown, NaN, a second header, a tooth that is missing or given twice.
    """
    columns = {"tooth": "1", "removed": "m", "single_pitch": "m"}
    measured = {"removed": LARGEST_AMOUNT, "single_pitch": LARGEST_AMOUNT}
    table = read_table(path, columns, optional=measured, key=("tooth",), largest=measured)
    given = [name for name in measured if name in table]
    require(len(given) == 1, f"{path} must hold one of the columns removed [um] and single_pitch [um], got {given}")
    teeth, z = table["tooth"], abs(gear.z)
    broken = teeth[teeth % 1 != 0]
    require(not broken.size, f"{path}: tooth must be whole numbers, got {', '.join(f'{x:g}' for x in broken[:1])}")
    first = int(teeth.min())
    require(first in (0, 1), f"{path}: teeth must be numbered from 0 or 1 on, got {first} as the least")
    missing = sorted({*range(first, first + z)} - {*teeth.astype(int).tolist()})
    lacks = f"{path} lacks tooth {', '.join(map(str, missing[:5]))} of the {z} teeth from {first} to {first + z - 1}"
    require(not missing, f"{lacks}; add a line for each")
    further = teeth[teeth >= first + z]
    too_many = f"{path} holds tooth {teeth.max():g}, but the gear has {z} teeth from {first} on; remove it"
    require(not further.size, too_many)
    values = table[given[0]][np.argsort(teeth)]
    if given[0] == "single_pitch":
        rest = abs(values.sum())
        closes = f"single pitch deviations must add up to 0 around the gear, got {rest / um:.3g} um in {path}"
        require(rest <= LARGEST_CLOSING_ERROR, f"{closes}; check the unit and that all pitches are there")
        values = -np.cumsum(values - values.mean())
        values -= values.mean()
    return PitchDeviation(tuple(values.tolist()))


@checked
def flank_traces(path: FilePath, gear: Gear, *, first: int | None = None) -> tuple[OnTooth, ...]:
    """Profile traces, helix traces or topographies of single teeth, as deviations of these teeth on grids.

    path    text file with a line for each point under the header tooth [1], roll [mm], axial [mm], removed [um].
            Without roll they are helix traces, which hold over the whole profile, without axial profile traces, over
            the width. The points of all teeth form one grid; teeth as in `pitch_chart`
    first   number of the first tooth of the gear in the table, 0 or 1; None: the table holds tooth 0, or the last
            tooth of a gear whose teeth are numbered from 1 on

    Teeth that are not in the table have no such deviations. Raises as `pitch_chart`, and ValueError where a point of
    the grid is missing, and where the table does not tell from which number on teeth are counted.
    """
    require(first in (None, 0, 1), f"first must be 0 or 1, the number of the first tooth in {path}, got {first}")
    axes, most = {"tooth": "1", "roll": "m", "axial": "m"}, {"removed": LARGEST_AMOUNT}
    lines, values = read_grid(path, axes, {"removed": "m"}, optional=("roll", "axial"), largest=most)
    require("tooth" in lines and len(lines) > 1, f"{path} must hold the column tooth, and roll or axial or both")
    teeth, removed, z = lines["tooth"], values["removed"], abs(gear.z)
    if first is None and teeth[0] > 0 and teeth[-1] < z:
        tells = f"{path} holds neither tooth 0 nor tooth {z}, so that its teeth may count from 0 or from 1 on"
        raise ValueError(f"{tells}; pass first=0 or first=1, the number of the first tooth")
    first = (0 if teeth[0] == 0 else 1) if first is None else first
    fits = bool((teeth % 1 == 0).all() and teeth[0] >= first and teeth[-1] < z + first)
    numbered = f"{path}: tooth must be whole numbers from {first} to {z + first - 1}, of {z} teeth"
    require(fits, f"{numbered}, got {', '.join(f'{x:g}' for x in teeth[:5])}{', ...' if teeth.size > 5 else ''}")
    single = [name for name in ("roll", "axial") if name in lines and lines[name].size < 2]
    require(not single, f"{path} must hold two points or more of a trace, got one value of {single}; leave it out")
    roll = lines.get("roll", np.array([gear.roll_form, gear.roll_tip]))
    axial = lines.get("axial", np.array([-gear.b / 2, gear.b / 2]))
    if "roll" not in lines:
        removed = np.broadcast_to(removed[:, None, :], (teeth.size, 2, axial.size))
    if "axial" not in lines:
        removed = np.broadcast_to(removed[:, :, None], (teeth.size, roll.size, 2))
    return tuple(
        OnTooth(int(tooth) - first, (Grid(tuple(roll), tuple(axial), tuple(map(tuple, of_tooth.tolist()))),))
        for tooth, of_tooth in zip(teeth, removed, strict=True)
    )


@checked
def wobble(gear: Gear, amplitude: Finite, angle: Finite = 0.0) -> tuple[OnTooth, ...]:
    """Helix slopes of a gear whose axis is tilted: tooth i of z has amplitude cos(2 pi i / z - angle).

    amplitude   C_Hbeta [m] of the tooth where it is largest: the tilt times the face width
    angle       of that tooth, counted as the teeth are [rad]
    """
    teeth = np.arange(abs(gear.z))
    slopes = amplitude * np.cos(2 * pi * teeth / abs(gear.z) - angle)
    return tuple(OnTooth(int(i), (HelixSlope(float(slope)),)) for i, slope in zip(teeth, slopes, strict=True))
