"""Published natural frequencies: a pair on bearings, and planetary sets."""

import numpy as np
import planetary_set
import pytest
from measured_rows import deviation
from modal_boxes import FOUR_PLANETS, THREE_PLANETS, pair_of_shafts, planets
from paper_gears import paper_gear, paper_pair
from scenes import linear_law

import exugear

#: Both gears free to spin and to move along the line of action on a spring (validation, section 2) [N/m, Hz].
ON_BEARINGS = {1e9: (2078.72, 2851.86, 4765.41), 2e8: (1002.75, 1275.39, 4417.94)}
#: Inertia of a wind turbine's rotor, of its generator seen from there [kg m^2], stiffness of the shaft between them
#: [N m/rad], frequency of the free drivetrain [Hz]. NREL 5 MW: Jonkman et al., NREL/TP-500-38060 (2009). DTU 10 MW: Bak
#: et al., DTU Wind Energy report I-0092 (2013), tables 6.2 and 6.3: 0.612 Hz with the generator held, ratio 50.
TURBINES = {
    "NREL 5 MW": (3.888e7, 534.116 * 97**2, 867.637e6, 2.223),
    "DTU 10 MW": (2317025352.0 / (2 * np.pi * 0.612) ** 2, 1500.5 * 50**2, 2317025352.0, 4.003),
}
#: Size of these drivetrains in the test, so that the teeth are rigid beside the shaft.
SMALL = 1e-6


@pytest.mark.parametrize("k", ON_BEARINGS)
def test_pair_on_bearings_has_the_known_frequencies(k, measured):
    """Across the line of action both shafts move alone."""
    data = exugear.modes(pair_of_shafts(exugear.Bearing(k, 1e9, 1e6)), load=1.0, drive="free")
    low, middle, high = ON_BEARINGS[k]
    rigid, *elastic = data["frequency"].values
    assert rigid == 0
    error = deviation(elastic, [low, middle, middle, middle, high])
    measured("modes of a pair on bearings, ky 1e9 and 2e8 N/m", error, 1e-4)


@pytest.mark.parametrize("turbine", TURBINES)
def test_drivetrains_of_wind_turbines_have_the_published_torsional_mode(turbine):
    rotor, generator, stiffness, published = TURBINES[turbine]
    coupling = exugear.Coupling(SMALL * stiffness, inertia=SMALL * rotor)
    fast = exugear.Shaft("fast", {0.0: paper_gear()}, inertia=0.01 * SMALL * generator)
    slow = exugear.Shaft("slow", {0.0: paper_gear(), 0.1: coupling}, inertia=0.99 * SMALL * generator)
    model = exugear.build(exugear.Gearbox([exugear.Stage(fast, slow, linear_law(), pair=paper_pair())]))
    rigid, torsion, *_ = exugear.modes(model, load=1e-3, drive="free")["frequency"].values
    assert rigid == 0
    assert torsion == pytest.approx(published, rel=5e-4)


@pytest.mark.parametrize(("number", "published"), [(3, THREE_PLANETS), (4, FOUR_PLANETS)])
def test_planetary_set_has_the_published_frequencies(number, published, measured):
    data = exugear.modes(planets(number))
    assert data["frequency"].values[0] == published[0] == 0
    error = deviation(data["frequency"].values[1:], published[1:])
    measured(f"all modes of a planetary set with {number} planets", error, 5e-4)
    assert "sun-planet 1" in data["stage"]
    assert float(data["energy_share"].sel(mode=slice(2, None)).sum("element").min()) == pytest.approx(1, rel=1e-12)


def test_planets_translate_the_sun_in_pairs_of_modes_and_spin_it_in_single_ones():
    data = exugear.modes(planets(3))
    moved = np.hypot(data["shape"], data["shape_imaginary"]).sel(coordinate=["sun x", "sun y", "sun spin"]).values
    x, y, spin = moved.T * np.array([1.0, 1.0, planetary_set.R_SUN])[:, None]
    translation = np.array([1, 2, 3, 4, 6, 7, 9, 10])
    assert (spin[translation] < 1e-4 * np.hypot(x, y)[translation]).all()
    assert (np.hypot(x, y)[[0, 5, 8, 11]] < 1e-4 * spin[[0, 5, 8, 11]]).all()
