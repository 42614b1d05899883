"""Plots of statics: harmonics, load sharing, contact pattern and contact lines."""

import numpy as np
import pytest
import xarray as xr
from loaded_gears import ROUGH, helical_gear
from paper_gears import paper_gear, paper_pair

import fem
from exugear import plots
from fem.units import MPa, mm, um

TORQUE = 150.0
PHASES = 12


@pytest.fixture(scope="module")
def spur() -> xr.Dataset:
    return fem.static_transmission_error(paper_pair(), [0, 50, TORQUE], PHASES, resolution=ROUGH, progress=False)


def distribution(pair: fem.GearPair, misalignment: float = 0.0) -> xr.Dataset:
    offsets = fem.Offsets(misalignment=misalignment)
    return fem.load_distribution(pair, TORQUE, PHASES, offsets=offsets, resolution=ROUGH, progress=False)


def test_harmonics_over_torque_and_as_bars(spur):
    amplitudes = fem.te_harmonics(spur, 3)["amplitude"] / um
    lines = plots.plot_te_harmonics(spur, plots.figure().axes[0], harmonics=3).lines
    assert [line.get_ydata()[-1] for line in lines] == pytest.approx(amplitudes.sel(torque=TORQUE).values)
    bars = plots.plot_te_harmonics(spur.sel(torque=[TORQUE]), plots.figure().axes[0], harmonics=3).patches
    assert [bar.get_height() for bar in bars] == pytest.approx(amplitudes.sel(torque=TORQUE).values)


def test_load_shares_one_pitch_apart_add_up_to_one(spur):
    ax = plots.plot_load_sharing(spur, plots.figure().axes[0])
    position, share = ax.lines[1].get_data()
    passed = np.sum([share[k::PHASES] for k in range(PHASES)], axis=1)
    assert passed == pytest.approx(1)
    assert np.diff(position) == pytest.approx(paper_pair().p_bt / PHASES / mm)
    assert [text.get_text() for text in ax.texts] == [*"ABCDE"]
    assert share[np.abs(position).argmin()] == pytest.approx(1), "single contact at the pitch point"


def test_load_sharing_needs_shares_of_a_single_offset(spur):
    with pytest.raises(ValueError, match="ste must have load shares; make the map with"):
        plots.plot_load_sharing(spur.drop_vars("load_share"))
    with pytest.raises(ValueError, match="ste also has the axes"):
        plots.plot_load_sharing(spur.expand_dims(misalignment=[0.0, 1e-4]))


@pytest.fixture(scope="module")
def set_back() -> fem.GearPair:
    """A pair of which tooth 1 of the pinion stands back by 8 um."""
    return fem.GearPair(paper_gear(flank=fem.PitchDeviation([0.0, 8 * um, *[0.0] * 55])), paper_gear(), a=150 * mm)


def test_all_pitches_of_a_map_are_drawn(set_back):
    phases = np.arange(4 * PHASES) / PHASES
    ste = fem.static_transmission_error(set_back, [TORQUE], phases, resolution=ROUGH, progress=False)
    ax = plots.plot_peak_pressure(ste, plots.figure().axes[0])
    assert ax.get_xlim() == (0, 4)
    assert ax.lines[0].get_xdata()[-2:] == pytest.approx([phases[-1], 4.0])
    ax = plots.plot_load_sharing(ste, plots.figure().axes[0])
    low, high = ax.get_xlim()
    path = set_back.path_of_contact
    assert high - low < 1.5 * (path.end - path.start) / mm
    steps = np.diff(ax.lines[0].get_xdata())
    assert steps[np.isfinite(steps)] == pytest.approx(set_back.p_bt / PHASES / mm)


def test_the_pattern_shows_the_largest_load_of_all_pitches(set_back):
    phases = np.arange(4 * PHASES) / PHASES
    data = fem.load_distribution(set_back, TORQUE, phases, resolution=ROUGH, progress=False)
    shown = plots.plot_contact_pattern(data, plots.figure().axes[0], name="line_load").collections[0].get_array()
    positions = np.round(data["pair"].values[:, None] + phases, 9)
    load = data["line_load"].sel(torque=TORQUE).transpose("pair", "phase", "axial_position").values
    at_pitch_point = load[positions == 0]
    assert len(at_pitch_point) > 2
    row = np.unique(positions).searchsorted(0.0)
    largest = np.pad(at_pitch_point.max(axis=0), 1, "edge") / 1e3
    assert np.asarray(shown)[row] == pytest.approx(largest)


def pattern(pair: fem.GearPair, misalignment: float = 0.0) -> np.ndarray:
    """(n_position, n_axial) line loads that the contact pattern shows."""
    ax = plots.plot_contact_pattern(distribution(pair, misalignment), plots.figure().axes[0], name="line_load")
    return ax.collections[0].get_array()


def test_the_pattern_of_a_crowned_pair_is_light_at_the_ends_of_the_face():
    crowned = fem.GearPair(paper_gear(flank=[fem.LeadCrowning(20 * um)]), paper_gear(), a=paper_pair().a)
    ends, middle = (pattern(crowned)[:, columns].max(axis=0) for columns in ([0, -1], [10, 11]))
    assert ends.max() < 0.7 * middle.min()
    assert ends[0] == pytest.approx(ends[1])


def test_the_pattern_of_few_phases_has_no_streaks_along_tip_edges():
    """Across the face, between lines of contact, the pressure at the edge is interpolated along the edge."""
    pair = fem.GearPair(helical_gear(1), helical_gear(-1))
    data = fem.load_distribution(pair, TORQUE, 6, resolution=ROUGH, progress=False)
    shown = plots.plot_contact_pattern(data, plots.figure().axes[0]).collections[0]
    triangles, end = shown._triangulation, (pair.path_of_contact.end - pair.path_of_contact.pitch) / mm
    corners = np.stack([triangles.x, triangles.y], axis=1)[triangles.triangles]
    at_end = corners[(corners[..., 1].min(axis=1) < end) & (corners[..., 1].max(axis=1) > end)]
    across, along = np.ptp(at_end, axis=1).T
    assert np.median(along) < 0.5 * pair.p_bt / 6 / mm
    assert np.median(across) > np.ptp(triangles.x) / 10


def test_misalignment_moves_the_pattern_towards_minus_z():
    load = pattern(paper_pair(), 4e-4).sum(axis=0)
    assert load[:10].sum() > 1.5 * load[-10:].sum()


def test_the_scale_of_pressure_ends_inside_the_path_of_contact():
    """On the sharp tip edges beyond it pressure has no limit; there the colour is that beyond the scale."""
    data = distribution(paper_pair())
    top = plots.plot_contact_pattern(data, plots.figure().axes[0]).collections[0].norm.vmax
    at_pitch_point = float(data["pressure"].sel(torque=TORQUE, pair=0, phase=0.0).max()) / MPa
    assert top == pytest.approx(at_pitch_point, rel=0.05)
    assert top < 0.5 * float(data["pressure"].max()) / MPa


def test_contact_lines_lie_in_the_plane_of_action():
    pair = fem.GearPair(helical_gear(1), helical_gear(-1))
    data = distribution(pair)
    (lines,) = plots.plot_load_distribution(data, plots.figure().axes[0], phase=0.25).collections
    ends = np.array(lines.get_segments())
    slopes = np.diff(ends[..., 1], axis=1) / np.diff(ends[..., 0], axis=1)
    assert slopes == pytest.approx(np.tan(pair.beta_b))
    loads = data["line_load"].sel(torque=TORQUE, phase=0.25).values
    assert np.sort(np.asarray(lines.get_array())) == pytest.approx(np.sort(loads[loads > 0]) / 1e3)
    for wrong, words in ({"torque": 1.0}, "torque must be one of"), ({"name": "te"}, "name must be one of"):
        with pytest.raises(ValueError, match=words):
            plots.plot_load_distribution(data, **wrong)
    with pytest.raises(ValueError, match=r"make it with fem\.load_distribution"):
        plots.plot_contact_pattern(data.drop_vars("path"))
