"""Animations: the deformed gears of a pair over the mesh cycle, a mode of vibration, and a gearbox that turns."""

import os
from collections.abc import Callable, Sequence
from math import inf
from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.animation import AbstractMovieWriter, FFMpegWriter, PillowWriter
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from exugear.multibody.model import Model
from exugear.plots.figures import add_axes
from exugear.plots.mode_plots import plot_modes
from exugear.plots.stress_plots import draw_field, plot_field, plot_outlines
from exugear.reporting.viewer import draw as draw_model
from exugear.reporting.viewer import picture, shown_at
from fem.pair.offsets import Offsets
from fem.pair.pair import GearPair
from fem.stress.cycle_fields import cycle_fields
from fem.stress.fields import Field
from fem.support.arguments import FilePath, Finite, checked
from fem.support.progress import bar, shown
from fem.support.validation import require
from fem.units import MPa, mm

__all__ = ["animate_gearbox", "animate_mode", "animate_pair"]

#: Displacement of the flanks as it is shown by default [modules]; half height of the view [modules].
SHOWN_DEFLECTION, VIEW = 0.1, 3.4
#: Pixels per inch of the figures, 8 x 4.5 in; colours of stress.
DPI, COLOURS = 100, "YlOrRd"
WRITERS: dict[str, type[PillowWriter] | type[FFMpegWriter]] = {".gif": PillowWriter, ".mp4": FFMpegWriter}

Bodies = list[tuple[np.ndarray, np.ndarray, np.ndarray]]


@checked
def animate_pair(
    pair: GearPair,
    torque: float,
    path: FilePath,
    *,
    frames: int = 24,
    scale: Finite | None = None,
    fps: Finite = 12.0,
    offsets: Offsets | None = None,
    progress: bool = True,
) -> Path:
    """Film of the deformed teeth of a pair over the mesh cycle, coloured by von Mises stress, in mid-plane.

    torque      pinion torque F r_b1 > 0 [N m]
    path        ends in .gif, or in .mp4 where ffmpeg is installed; an interrupted write leaves no file, or the old one
    frames      number of phases of the mesh cycle, at least 4; the film repeats without a jump
    scale       magnification of the displacements; by default the largest is 0.1 modules. Flanks in contact remain in
                contact; others may overlap, as their gap is not magnified
    fps         frames per second
    offsets     offsets of the wheel, one value each
    progress    whether to show a bar with the time left

    Returns the path. The elements resolve bending, but not the stress under the line of contact (`fem.stress` does).
    A frame takes 0.2 s; of a helical pair, which is solved as a solid, 1.2 s, and 10 s in advance.
    Raises ValueError for bad input and MP4 without ffmpeg.
    """
    path, writer = Path(path), _writer(path, fps)
    require(4 <= frames <= 1000, f"frames must lie in [4, 1000], got {frames}")
    with shown(progress):
        fields = cycle_fields(pair, torque, frames, offsets=offsets)
    require(scale is None or 0 < scale < inf, f"scale must be > 0 and finite, got {scale}")
    scale = _magnification(fields, SHOWN_DEFLECTION * pair.pinion.m_n) if scale is None else scale
    bodies: list[Bodies] = [[(f.deformed(scale), f.cells, f.von_mises / MPa) for f in gears] for gears in fields]
    # Tip edges in contact have far larger stresses in a few frames.
    top = float(np.median([max(values.max() for *_, values in gears) for gears in bodies]))
    figure = Figure(figsize=(8, 4.5), layout="constrained")
    ax = add_axes(figure)
    plot_field(bodies[0], "von Mises stress [MPa]", ax, top=top, colours=COLOURS)
    ax.set_title(f"{torque:.4g} N m, displacements magnified {scale:g} times")
    half, middle = VIEW * pair.pinion.m_n / mm, pair.path_of_contact.r_w[0] / mm
    ax.set(xlim=(middle - 1.45 * half, middle + 1.45 * half), ylim=(-half, half))

    def draw(frame: int) -> None:
        _clear(ax)
        draw_field(bodies[frame], ax, {"cmap": COLOURS, "vmin": 0, "vmax": top})
        plot_outlines(bodies[frame], ax)

    with shown(progress):
        return _film(figure, draw, frames, path, writer)


@checked
def animate_mode(
    data: xr.Dataset, mode: int, path: FilePath, *, frames: int = 24, fps: Finite = 12.0, progress: bool = True
) -> Path:
    """Film of a mode of vibration as `exugear.plots.plot_modes` draws it, over a period of the vibration.

    data    of `exugear.modes`
    mode    its number, 1 for the lowest frequency
    path    ends in .gif, or in .mp4 where ffmpeg is installed; an interrupted write leaves no file, or the old one
    frames  number of frames of a period, at least 4; the film repeats without a jump
    fps     frames per second
    progress
            whether to show a bar with the time left

    Returns the path. Raises ValueError for bad input and MP4 without ffmpeg.
    """
    path, writer = Path(path), _writer(path, fps)
    require(4 <= frames <= 1000, f"frames must lie in [4, 1000], got {frames}")
    figure = Figure(figsize=(8, 4.5), layout="constrained")
    ax = add_axes(figure)
    for angle in (0.0, np.pi / 2, np.pi, 3 * np.pi / 2):
        plot_modes(data, ax, mode, angle)
    ax.set(xlim=ax.get_xlim(), ylim=ax.get_ylim())

    def draw(frame: int) -> None:
        _clear(ax)
        plot_modes(data, ax, mode, 2 * np.pi * frame / frames)

    with shown(progress):
        return _film(figure, draw, frames, path, writer)


@checked
def animate_gearbox(
    model: Model,
    path: FilePath,
    *,
    turn: Finite | None = None,
    frames: int = 24,
    fps: Finite = 12.0,
    size: Sequence[int] = (900, 600),
    rotation: Sequence[float] = (0.4, 0.6, 0.0),
    zoom: float = 0.92,
    progress: bool = True,
) -> Path:
    """Film of a gearbox whose gears turn in mesh, with planets that orbit, as `exugear.draw` and `picture` show it.

    turn     angle of the driving shaft from the first frame to one beyond the last [rad]; by default the first carrier
             turns from each of its planets to the next one, without a carrier the driving shaft once
    frames   number of frames, at least 4; a frame takes a second or two
    fps      frames per second
    size, rotation, zoom
             as of `exugear.picture`

    The train turns at its nominal ratios, without vibration. Returns the path. Raises ValueError for bad input and MP4
    without ffmpeg.
    """
    path, writer = Path(path), _writer(path, fps)
    require(4 <= frames <= 1000, f"frames must lie in [4, 1000], got {frames}")
    turn = _turn_of(model) if turn is None else turn
    require(turn != 0 and abs(turn) < inf, f"turn must be an angle other than 0 [rad], got {turn:g}")
    draw_model(model)
    figure = Figure(figsize=(size[0] / DPI, size[1] / DPI))
    ax = figure.add_axes((0.0, 0.0, 1.0, 1.0))

    def draw(frame: int) -> None:
        _clear(ax)
        with shown_at(model, turn * frame / frames):
            ax.imshow(picture(model, size=size, rotation=rotation, zoom=zoom))
        ax.set_axis_off()

    with shown(progress):
        return _film(figure, draw, frames, path, writer)


def _turn_of(model: Model) -> float:
    """Angle of the driving shaft [rad] in which the first carrier that turns passes the angle between two planets."""
    box = model.gearbox
    for carrier in {shaft.name: shaft for shaft in box.planets.values()}:
        planets = sum(shaft.name == carrier for shaft in box.planets.values())
        if ratio := float(box.ratios[carrier]):
            return 2 * np.pi / planets / abs(ratio)
    return 2 * np.pi


def _magnification(fields: list[tuple[Field, Field]], shown: float) -> float:
    """Magnification, of one digit, by which the largest displacement is shown as about so large [m]."""
    largest = max(
        float(np.ptp(field.deformed(1) - field.deformed(0), axis=1).max()) for pair in fields for field in pair
    )
    return float(f"{shown / largest:.1g}")


def _writer(path: FilePath, fps: float) -> AbstractMovieWriter:
    """Writer of the kind of file that a path ends in; ValueError for others, and where ffmpeg is missing."""
    kind = Path(path).suffix.lower()
    require(kind in WRITERS, f"path must end in .gif or .mp4, got {path}")
    require(Path(path).resolve().parent.is_dir(), f"path must lie in a folder that exists, got {path}")
    require(0 < fps <= 100, f"fps must lie in (0, 100] frames per second, got {fps}")
    missing = f"path must end in .gif where ffmpeg is not installed, got {path}; install ffmpeg for MP4"
    require(WRITERS[kind].isAvailable(), missing)
    return WRITERS[kind](fps=fps)  # type: ignore[arg-type]


def _clear(ax: Axes) -> None:
    """Remove all artists of axes, which keep their limits, title and labels."""
    for artist in [*ax.collections, *ax.lines, *ax.patches, *ax.texts, *ax.images]:
        artist.remove()


def _film(figure: Figure, draw: Callable[[int], None], frames: int, path: Path, writer: AbstractMovieWriter) -> Path:
    """Write the frames that a function draws into a figure, whose layout stays; the file is complete or absent."""
    draw(0)
    figure.draw_without_rendering()
    figure.set_layout_engine("none")
    part = path.with_name(f".{path.stem}.{os.getpid()}.part{path.suffix}")
    try:
        with writer.saving(figure, str(part), DPI):
            for frame in bar(range(frames), f"film {path.name}"):
                draw(frame)
                writer.grab_frame()
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)
    return path
