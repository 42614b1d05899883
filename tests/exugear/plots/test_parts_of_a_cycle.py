"""What assumes a whole mesh cycle refuses a selection of its phases; curves of both sides of a map."""

from functools import partial

import numpy as np
import pytest
from scenes import smooth_map

import exugear
import fem
from exugear import plots

STRESSES = fem.ste_map(fem.pair_of(smooth_map()), [0, 100], np.arange(8) / 8, np.outer([0, 1e-5], np.ones(8)))
CALLS = {
    "ste": plots.plot_ste,
    "stiffness": plots.plot_stiffness,
    "harmonics": fem.te_harmonics,
    "bars": plots.plot_te_harmonics,
    "peak to peak": fem.peak_to_peak,
    "friction": partial(exugear.MeshFriction.from_ste, coefficient=0.05, torque=100.0),
}


@pytest.mark.parametrize("name", CALLS)
def test_half_a_mesh_cycle_is_refused(name):
    half = smooth_map().sel(phase=slice(0, 0.5))
    with pytest.raises(ValueError, match=r"phase must cover the mesh cycle, but a gap of 0\.5 pitches is left"):
        CALLS[name](half)


def test_pressure_over_half_a_cycle_is_refused():
    pressure = STRESSES.assign({name: abs(STRESSES["te"]) for name in ("hertz_pressure", "tip_contact")})
    assert plots.plot_pressure(pressure).lines
    with pytest.raises(ValueError, match="phase must cover the mesh cycle"):
        plots.plot_pressure(pressure.sel(phase=slice(0, 0.5)))


def test_both_sides_of_a_map_are_drawn():
    left = smooth_map((0, 100, 350))
    both = fem.ste_map(
        fem.pair_of(left), [-100, 0, 100, 350], left["phase"], np.r_[-left["te"].values[[1]], left["te"]]
    )
    labels = [line.get_label() for line in plots.plot_stiffness(both).lines]
    assert labels == ["-100 N m", "100 N m", "350 N m"]
    curves = [line.get_ydata() for line in plots.plot_stiffness(both).lines]
    assert curves[0] == pytest.approx(curves[1])
