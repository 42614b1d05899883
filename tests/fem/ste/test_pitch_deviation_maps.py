"""Maps of pairs with pitch deviations: closed forms of rigid flanks, and deviations that only turn a gear."""

import numpy as np
import pytest
from coarse_maps import COARSE
from paper_gears import paper_gear
from scipy.optimize import brentq

import fem
from exugear import plots
from fem.units import mm, um


def test_a_tooth_set_back_carries_less_load_and_opens_a_gap_without_load():
    """A pitch deviation sets a tooth of the pinion back by 8 um."""
    deviation = [0.0] * 57
    deviation[0] = 8 * um
    gear = paper_gear(flank=fem.PitchDeviation(deviation))
    pair = fem.GearPair(gear, paper_gear(), a=150 * mm)
    ste = fem.static_transmission_error(pair, [0, 150], np.arange(16) / 4, resolution=COARSE, progress=False)
    te = ste["te"].values / um
    assert te[0].min() == pytest.approx(0, abs=0.01)
    assert te[0].max() == pytest.approx(8, abs=0.01)
    share = ste["load_share"].sel(torque=150)
    set_back = share.sel(pair=0).values[ste["phase"].values < 1]
    nominal = fem.GearPair(paper_gear(), paper_gear(), a=150 * mm)
    plain = fem.static_transmission_error(nominal, 150, 4, resolution=COARSE, progress=False)
    assert (set_back <= plain["load_share"].sel(torque=150, pair=0).values + 1e-9).all()
    assert te[1, -4:] == pytest.approx(plain["te"].values[0] / um, rel=1e-3)
    with pytest.raises(ValueError, match="differ from one another"):
        plots.plot_stiffness(ste)


def test_phases_may_end_on_a_whole_pitch():
    """From pitch point to pitch point; the last phase belongs to the next pitch."""
    gear = paper_gear(flank=fem.PitchDeviation(np.linspace(0, 5 * um, 57)))
    pair, plain = fem.GearPair(gear, paper_gear(), a=150 * mm), fem.GearPair(paper_gear(), paper_gear(), a=150 * mm)
    ste = fem.static_transmission_error(pair, [0, 150], [0, 0.5, 1], resolution=COARSE, progress=False)
    assert ste.attrs["pitches"] == 2
    single_pitch = fem.static_transmission_error(plain, 0, [0, 0.5], resolution=COARSE, progress=False)
    assert single_pitch.attrs["pitches"] == 1


def test_phases_need_not_be_neighbours():
    """Neither 0.1 nor 5.1 touches the deviating tooth."""
    deviation = [0.0] * 57
    deviation[3] = 8 * um
    pair = fem.GearPair(paper_gear(flank=fem.PitchDeviation(deviation)), paper_gear(), a=150 * mm)
    ste = fem.static_transmission_error(pair, [150], [0.1, 20.1], resolution=COARSE, progress=False)
    assert ste["te"].values[0, 1] == pytest.approx(ste["te"].values[0, 0], rel=1e-9)
    assert ste["load_share"].sum("pair").values == pytest.approx(1)


def hunting(pinion=(), wheel=()) -> fem.GearPair:
    data = {"m_n": 3 * mm, "b": 20 * mm, "d_bore": 25 * mm}
    gears = fem.Gear(z=21, x=0.25, flank=pinion, **data), fem.Gear(z=37, x=-0.1, flank=wheel, **data)
    return fem.GearPair(*gears, a=fem.GearPair(*gears).a + 0.1 * mm)


def touching_at_the_corner(pair: fem.GearPair, roll: float, removed: tuple[float, float]) -> float:
    """Transmission error at which a wheel's tip touches the pinion's flank, two rigid involutes turned back [m].

    roll        length of the pinion, before the path of contact, where they would touch on the line of action [m]
    """
    (r_1, r_2), tip = (pair.pinion.r_b, pair.wheel.r_b), pair.wheel.roll_tip
    alpha = np.arccos((r_1 + r_2) / pair.a)

    def angular_gap(te):
        ends = roll + te / 2 - removed[0], pair.a * np.sin(alpha) - roll + te / 2 - removed[1]
        turned = alpha + (tip - ends[1]) / r_2 - np.arctan(tip / r_2)
        corner = pair.a - np.hypot(r_2, tip) * np.exp(1j * turned)
        corner_roll = np.sqrt(abs(corner) ** 2 - r_1**2)
        return np.angle(corner) - (alpha + (corner_roll - ends[0]) / r_1 - np.arctan(corner_roll / r_1))

    return brentq(angular_gap, -100 * um, 100 * um, xtol=1e-15)


@pytest.mark.parametrize("amount", [10 * um, 20 * um, 40 * um])
@pytest.mark.parametrize("thicker", ["pinion", "wheel"])
def test_rigid_tip_of_a_thicker_tooth_touches_before_the_path_of_contact(thicker, amount, measured):
    z = {"pinion": 21, "wheel": 37}[thicker]
    pair = hunting(**{thicker: fem.PitchDeviation([-amount] + [0.0] * (z - 1))})
    phase = z - np.array([0.78, 0.75, 0.72, 0.69])
    te = fem.static_transmission_error(pair, 0, phase, resolution=COARSE, progress=False)["te"].values[0]
    rolls, removed = pair.roll_pitch + (phase - z) * pair.p_bt, (-amount * (z == 21), -amount * (z == 37))
    exact = [touching_at_the_corner(pair, roll, removed) for roll in rolls]
    assert min(exact) < -amount / 2
    error = np.abs(te - np.minimum(exact, 0.0)).max()
    measured("te without load, teeth 10 to 40 µm too thick whose tip corners touch", error / amount, 1e-4)


@pytest.mark.parametrize(("pinion", "wheel"), [(40 * um, 0.0), (0.0, 40 * um), (10 * um, -30 * um)])
def test_the_same_deviation_of_all_teeth_only_turns_the_gear(pinion, wheel):
    """Under load too, and where tips touch: te(phase) shifts by the difference along the line of action.

    The compliance does not shift with the flanks: 40 um change it by 0.1 %.
    """
    deviating = hunting(fem.PitchDeviation([pinion] * 21), fem.PitchDeviation([wheel] * 37))
    phase = np.linspace(0.04, 0.96, 12)
    turned = phase + (wheel - pinion) / (2 * deviating.p_bt)
    maps = [
        fem.static_transmission_error(pair, [0, 300], at, resolution=COARSE, progress=False)["te"].values
        for pair, at in ((deviating, phase), (hunting(), turned))
    ]
    assert maps[0] - pinion - wheel == pytest.approx(maps[1], abs=0.06 * um)
