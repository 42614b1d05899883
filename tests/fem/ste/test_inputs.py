"""Inputs of a map: bad torques, phases, offsets, accuracies and resolutions are refused with a remedy."""

import numpy as np
import pytest
from paper_gears import few_teeth

import fem
from fem import Density
from fem.units import deg, mm


@pytest.mark.parametrize(
    ("torque", "phases", "message"),
    [
        ([150, 100], 30, "sort it"),
        (150e3, 30, "pass newton metres"),
        ([0, 1e-8, 150], 30, r"torque must be 0 or 3\.4e-05 N m and more; .* lost in rounding, got 1e-08"),
        (np.nan, 30, "torque must"),
        ([], 30, "torque must"),
        (150, 2, "phases must be a whole number"),
        (150, 7.5, "phases must be a whole number"),
        (150, [0.5, 0.2], "phases must increase"),
        (150, [0.5, 1.0], "phases must increase"),
        (150, [[0.1, 0.2]], "phases must increase"),
        (150, [[0.1, 0.2], [0.3]], "phases must hold real numbers"),
        (150, "30", "phases must hold real numbers"),
        ("150", 30, "torque must hold real numbers"),
        (None, 30, "torque must hold real numbers"),
    ],
)
def test_bad_torques_and_phases_are_refused(paper_pair, torque, phases, message):
    with pytest.raises(ValueError, match=message):
        fem.static_transmission_error(paper_pair, torque, phases, progress=False)


@pytest.mark.parametrize(
    ("torque", "phases", "options", "message"),
    [
        (150, 30, {"accuracy": 0.5}, "accuracy must lie in"),
        (150, 30, {"accuracy": float("nan")}, "accuracy must lie in"),
        (150, 30, {"accuracy": "0.01"}, "accuracy must be one real number"),
        (150, None, {}, "need an accuracy"),
        (fem.UpTo(150), 30, {"resolution": fem.Resolution()}, "need an accuracy"),
        (0, 30, {"accuracy": 0.01}, "needs a torque > 0"),
        (fem.UpTo(1e6), 30, {"accuracy": 0.01}, "Hertz pressure passes"),
        (fem.UpTo(1e-3), 30, {"accuracy": 0.01}, r"torque must be 0\.034 N m or more, as torques far below it"),
        (150, 30, {"accuracy": fem.Resolution(slices=40)}, r"pass resolution=fem\.Resolution\("),
        (150, 30, {"accuracy": fem.Slices()}, r"pass resolution=fem\.Slices\("),
        (150, 30, {"accuracy": 0.01, "resolution": fem.Slices()}, "leave out accuracy or resolution"),
        (150, 30, {"resolution": 0.01}, r"resolution must be a fem\.Resolution, a fem\.Slices or None, got 0\.01"),
    ],
)
def test_bad_requests_are_refused(paper_pair, torque, phases, options, message):
    with pytest.raises(ValueError, match=message):
        fem.static_transmission_error(paper_pair, torque, phases, progress=False, **options)
    with pytest.raises(ValueError, match=message):
        fem.map_cost(paper_pair, torque, phases, **options)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: fem.Offsets(a=(0.151, 0.150)), "a must increase; sort it"),
        (lambda: fem.Offsets(misalignment=0.5), "pass radians"),
        (lambda: fem.Offsets(axial=float("nan")), "axial must be finite, got nan"),
        (lambda: fem.Offsets(axial=None), "axial must be a number or increasing numbers .*0: none.*got None"),
        (lambda: fem.Offsets(misalignment=None), "misalignment must be a number .*got None"),
        (lambda: fem.Offsets(axial="1e-3"), "axial must hold real numbers"),
        (lambda: fem.Resolution(Density(), 20, False), r"neighbours must .*got False; .*fem\.Slices\(\) one line load"),
        (lambda: fem.Resolution(density=4), "density must be a fem.Density"),
        (lambda: fem.Resolution(slices="20"), "slices must be one real number"),
        (lambda: fem.Resolution(slices=float("inf")), "slices must be an even number"),
        (lambda: fem.UpTo("350"), "torque must be one real number"),
        (lambda: fem.Resolution(slices=5), "slices must be an even number"),
        (lambda: fem.Slices(slices=5), "slices must be an even number"),
        (lambda: fem.Resolution(neighbours=-1), "neighbours must be a whole number of pitches"),
    ],
)
def test_bad_offsets_and_resolutions_are_refused(call, message):
    with pytest.raises(ValueError, match=message):
        call()


def test_offsets_of_another_kind_are_refused(paper_pair):
    for offsets in ({"misalignment": 1e-4}, {}, 1e-4):
        with pytest.raises(ValueError, match=r"offsets must be fem.Offsets, say fem.Offsets\(misalignment"):
            fem.static_transmission_error(paper_pair, 150, 4, offsets=offsets, progress=False)


def test_numbers_of_any_library_become_python_numbers():
    offsets = fem.Offsets(a=np.float32(0.15), misalignment=np.array([0, 1e-4], np.float32), axial=np.int64(0))
    assert offsets == fem.Offsets(a=float(np.float32(0.15)), misalignment=(0.0, float(np.float32(1e-4))))
    assert offsets.axes() == ("misalignment",) and type(offsets.a) is type(offsets.axial) is float
    assert fem.Offsets(a=None) == fem.Offsets()
    resolution = fem.Resolution(Density(flank=np.int64(8), width=np.int32(2)), np.int64(6), np.int8(1))
    assert repr(resolution) == repr(fem.Resolution(Density(flank=8, width=2), 6, neighbours=1))


def test_stresses_need_strips(paper_pair):
    with pytest.raises(ValueError, match=r"resolution must be a fem\.Resolution or None, got Slices"):
        fem.root_stress(paper_pair, 100, 4, resolution=fem.Slices(), progress=False)


def test_offsets_beyond_the_gears_are_refused(paper_pair):
    for offsets, message in ((fem.Offsets(axial=22 * mm), "face in contact"), (fem.Offsets(a=139 * mm), "a must lie")):
        with pytest.raises(ValueError, match=message):
            fem.static_transmission_error(paper_pair, 150, 4, offsets=offsets, progress=False)
    helical = fem.GearPair(few_teeth(beta=25 * deg, d_a=46 * mm), few_teeth(beta=-25 * deg, d_a=46 * mm))
    assert helical.eps_alpha < 1 < helical.eps_gamma
    with pytest.raises(ValueError, match=r"axial offset 17 mm leaves a contact ratio of .*, which must exceed 1"):
        fem.static_transmission_error(helical, 10, 4, offsets=fem.Offsets(axial=(0, 17 * mm)), progress=False)


def test_generators_are_read_once_and_masked_values_are_refused(paper_pair):
    options = {"resolution": fem.Slices(), "progress": False}
    listed = fem.static_transmission_error(paper_pair, [0.0, 5.0], [0.0, 0.5], **options)
    torque, phases = (t for t in (0.0, 5.0)), iter([0.0, 0.5])
    assert fem.static_transmission_error(paper_pair, torque, phases, **options).equals(listed)
    masked = np.ma.array([0.0, 5.0, 1000.0], mask=[0, 0, 1])
    with pytest.raises(ValueError, match="torque must hold a value everywhere, got masked values"):
        fem.static_transmission_error(paper_pair, masked, 4, **options)
    assert fem.static_transmission_error(paper_pair, masked[:2], [0.0, 0.5], **options).equals(listed)


def test_an_accuracy_does_not_choose_phases_of_unlike_pitches():
    pair = fem.GearPair(few_teeth(flank=fem.PitchDeviation(np.arange(20) * 1e-7)), few_teeth())
    with pytest.raises(ValueError, match="phases must be given with PitchDeviation"):
        fem.static_transmission_error(pair, [0, 50], None, accuracy=0.05, progress=False)


@pytest.mark.parametrize(
    ("torque", "attributes", "message"),
    [
        ([0, np.inf], {}, "torque must be finite"),
        ([0, 10], {"pinion_z": 3}, "attributes .'pinion_z'. are inputs of the pair"),
    ],
)
def test_bad_maps_of_other_programs_are_refused(paper_pair, torque, attributes, message):
    with pytest.raises(ValueError, match=message):
        fem.ste_map(paper_pair, torque, [0, 0.5], np.zeros((2, 2)), **attributes)
