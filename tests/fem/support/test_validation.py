"""Messages of input checks name the argument, its value and a remedy."""

import numpy as np
import pytest
import xarray as xr
from paper_gears import paper_pair

import fem


def map_of(torque) -> xr.Dataset:
    """A map of te = 0 over torques."""
    return fem.ste_map(paper_pair(), torque, [0.0], np.zeros((np.size(torque), 1)))


def test_increasing_values_come_back_as_an_array_of_floats():
    torque = map_of((0, 50, 150))["torque"].values
    assert torque.tolist() == [0.0, 50.0, 150.0] and torque.dtype == float
    assert fem.Density(edges=[]).edges == ()


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ([0, 150, 50], r"torque must increase; sort it, got \[0, 150, 50\]"),
        ([0, 50, 50], "torque must increase; sort it"),
        ([0, np.nan], r"torque must be finite, got nan at \[1\]"),
        ([np.nan], r"torque must be finite, got nan at \[0\]"),
        ([], "torque must increase over at least 1 values"),
        ([[0, 50]], r"torque must increase along one axis \(n,\), got the shape \(1, 2\)"),
        (50, r"torque must increase along one axis \(n,\), got the shape \(\)"),
        (["0", "50"], "torque must hold real numbers"),
    ],
)
def test_values_that_do_not_increase_are_refused(values, message):
    with pytest.raises(ValueError, match=message):
        map_of(values)
