"""Messages of input checks name the argument, its value and a remedy."""

import numpy as np
import pytest

from fem.support.validation import increases, increasing


def test_increasing_values_come_back_as_an_array_of_floats():
    assert increasing("torque", (0, 50, 150)).tolist() == [0.0, 50.0, 150.0]
    assert increasing("edges", [], least=0).size == 0


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
        increasing("torque", values)


def test_rows_of_a_table_increase_along_the_last_axis():
    assert increases(np.array([[0.0, 1.0], [-1.0, 0.0]]))
    assert not increases(np.array([[0.0, 1.0], [1.0, 1.0]]))
