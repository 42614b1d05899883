"""Films: number of frames, motion, whole files."""

import numpy as np
import pytest
from matplotlib.animation import FFMpegWriter
from modal_boxes import three_shafts
from paper_gears import few_teeth
from PIL import Image, ImageSequence
from planetary_boxes import planar_box, planetary_box

import exugear
import fem

SPUR = fem.GearPair(few_teeth(), few_teeth(z=31))


def frames_of(path) -> np.ndarray:
    """(n, height, width, 3) frames of a film."""
    with Image.open(path) as film:
        return np.array([np.asarray(frame.convert("RGB"), int) for frame in ImageSequence.Iterator(film)])


def test_the_film_of_a_pair_moves_and_repeats_without_a_jump(tmp_path):
    path = exugear.animate_pair(SPUR, 50.0, tmp_path / "pair.gif", frames=4)
    frames = frames_of(path)
    assert len(frames) == 4
    changes = np.abs(frames - np.roll(frames, -1, axis=0)).mean(axis=(1, 2, 3))
    assert changes.min() > 1
    assert changes[-1] < 1.5 * changes[:-1].max(), "from the last frame to the first as between the others"
    assert [file.name for file in tmp_path.iterdir()] == ["pair.gif"]


def test_the_film_of_a_mode_goes_there_and_back(tmp_path):
    """A quarter of a period from rest to rest: the second and the last frame are the shape at rest."""
    modes = exugear.modes(three_shafts(), load=150.0)
    frames = frames_of(exugear.animate_mode(modes, 3, tmp_path / "mode.gif", frames=4))
    assert len(frames) == 4
    change = np.abs(frames[:, None] - frames).mean(axis=(2, 3, 4))
    assert change[0, 2] > change[0, 1] > 10 * change[1, 3]
    with pytest.raises(ValueError, match="mode must lie in"):
        exugear.animate_mode(modes, 1000, tmp_path / "none.gif")
    assert [file.name for file in tmp_path.iterdir()] == ["mode.gif"]


@pytest.mark.parametrize("box", [planetary_box, planar_box])
def test_the_film_of_a_set_turns_from_planet_to_planet(tmp_path, box):
    """Planets on ideal and on elastic pins orbit by 120 deg; the state of the model stays."""
    model = exugear.build(box())
    before = model.mbs.systemData.GetODE2Coordinates()
    options = {"frames": 4, "size": (150, 100), "progress": False}
    frames = frames_of(exugear.animate_gearbox(model, tmp_path / "set.gif", **options))
    changes = np.abs(frames - np.roll(frames, -1, axis=0)).mean(axis=(1, 2, 3))
    assert len(frames) == 4 and changes.min() > 1
    assert np.array_equal(before, model.mbs.systemData.GetODE2Coordinates())
    with pytest.raises(ValueError, match="turn must be an angle other than 0"):
        exugear.animate_gearbox(model, tmp_path / "none.gif", turn=0.0)


def test_an_interrupted_film_leaves_the_old_file(tmp_path, monkeypatch):
    path = tmp_path / "pair.gif"
    path.write_bytes(b"old")
    drawn = []

    def full_disk(bodies, ax):
        drawn.append(bodies)
        if len(drawn) == 3:
            raise OSError("No space left on device")

    monkeypatch.setattr("exugear.reporting.animation.plot_outlines", full_disk)
    with pytest.raises(OSError, match="No space left"):
        exugear.animate_pair(SPUR, 50.0, path, frames=4)
    assert path.read_bytes() == b"old"
    assert [file.name for file in tmp_path.iterdir()] == ["pair.gif"]


@pytest.mark.parametrize(
    ("name", "options", "words"),
    [
        ("pair.avi", {}, "path must end in .gif or .mp4"),
        ("pair.mp4", {}, "path must end in .gif where ffmpeg is not installed, got .*; install ffmpeg for MP4"),
        ("pair.gif", {"frames": 2}, r"frames must lie in \[4, 1000\], got 2"),
        ("pair.gif", {"fps": 0.0}, r"fps must lie in \(0, 100\]"),
        ("pair.gif", {"torque": 0.0}, "torque must be > 0 N m"),
        ("no folder/pair.gif", {}, "path must lie in a folder that exists"),
    ],
)
def test_films_that_cannot_be_written_are_refused(name, options, words, tmp_path, monkeypatch):
    monkeypatch.setattr(FFMpegWriter, "isAvailable", classmethod(lambda cls: False))
    given = {"pair": SPUR, "torque": 50.0, "path": tmp_path / name} | options
    with pytest.raises(ValueError, match=words):
        exugear.animate_pair(**given)
