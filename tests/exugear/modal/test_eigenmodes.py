"""Eigenmodes of matrices: closed forms with gyroscopic terms and damping, and lines over the speed."""

import numpy as np
import pytest
import scipy

from exugear.planning.eigenmodes import eigenmodes, tracked

GYROSCOPIC = np.array([[0.0, 1.0], [-1.0, 0.0]])


def random_system(n: int = 6) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Positive definite mass and stiffness matrices and a skew-symmetric one."""
    generator = np.random.default_rng(7)
    a, b, c = generator.normal(size=(3, n, n))
    return a @ a.T + n * np.eye(n), 1e4 * (b @ b.T + np.eye(n)), 30.0 * (c - c.T)


def complex_eigenvalues(mass, stiffness, damping) -> np.ndarray:
    """Eigenvalues of the equations of first order."""
    lower = [-np.linalg.solve(mass, x) for x in (stiffness, damping)]
    return scipy.linalg.eigvals(np.block([[np.zeros_like(mass), np.eye(len(mass))], lower]))


def test_modes_at_rest_are_orthogonal_and_normalized():
    mass, stiffness, _ = random_system()
    solved = eigenmodes(mass, stiffness, np.zeros_like(mass))
    assert solved.shapes.conj().T @ mass @ solved.shapes == pytest.approx(np.eye(6), abs=1e-12)
    assert np.isrealobj(solved.shapes)


def test_gyroscopic_modes_solve_the_quadratic_eigenvalue_problem():
    mass, stiffness, gyroscopic = random_system()
    solved = eigenmodes(mass, stiffness, gyroscopic)
    for omega, x in zip(solved.omega, solved.shapes.T, strict=True):
        residual = (stiffness - omega**2 * mass + 1j * omega * gyroscopic) @ x
        assert np.abs(residual).max() < 1e-9 * np.abs(stiffness @ x).max()
    assert (np.diff(solved.omega) >= 0).all()
    assert np.abs(solved.damping_ratio).max() < 1e-15


def test_light_damping_is_that_of_the_complex_eigenvalues():
    mass, stiffness, gyroscopic = random_system()
    damping = gyroscopic + 1e-6 * stiffness
    values = complex_eigenvalues(mass, stiffness, damping)
    values = values[values.imag > 0]
    expected = (-values.real / np.abs(values))[np.argsort(values.imag)]
    assert eigenmodes(mass, stiffness, damping).damping_ratio == pytest.approx(expected, rel=1e-5)


@pytest.mark.parametrize("coupling", [0.0, 1e-9, 0.5, 2.0, 8.0, 1e3])
@pytest.mark.parametrize("gyroscopic", [0.0, 0.3])
def test_damping_of_equal_oscillators_is_that_of_the_complex_eigenvalues(coupling, gyroscopic):
    """Only the first oscillator is damped; a spring couples them less, as much as, and more than the damper."""
    mass, spring = np.eye(4), coupling * np.kron([[1.0, -1.0], [-1.0, 1.0]], np.eye(2))
    stiffness = 1e4 * np.eye(4) + spring
    damping = np.diag([0.02, 0.02, 0.0, 0.0]) + gyroscopic * np.kron(np.eye(2), GYROSCOPIC)
    values = complex_eigenvalues(mass, stiffness, damping)
    exact = np.sort(-values.real[values.imag > 0] / np.abs(values[values.imag > 0]))
    solved = eigenmodes(mass, stiffness, damping)
    assert np.sort(solved.damping_ratio) == pytest.approx(exact, abs=1e-3 * 1e-4)
    if coupling < 0.1:
        undamped_oscillator = solved.shapes[2:, solved.damping_ratio > 0.9e-4]
        assert undamped_oscillator == pytest.approx(np.zeros((2, 2)), abs=1e-6)


def test_proportional_damping_is_exact_at_any_size():
    mass, stiffness, _ = random_system()
    solved = eigenmodes(mass, stiffness, 0.01 * stiffness)
    assert solved.damping_ratio == pytest.approx(0.005 * solved.omega, rel=1e-9)


def test_free_disc_nutates_and_rests():
    """Without springs a disc with J_p = 1.5 J_t nutates at 1.5 times its speed."""
    solved = eigenmodes(np.eye(2), np.zeros((2, 2)), 1.5 * 100.0 * GYROSCOPIC)
    assert solved.omega == pytest.approx([0.0, 150.0], rel=1e-12)


def test_lines_cross_where_their_shapes_stay():
    """Backward and forward whirl of a disc, and a mode beside them that both of them cross."""
    mass, stiffness = np.eye(3), np.diag([1e4, 1e4, 1.3e4])
    gyroscopic = np.zeros((3, 3))
    gyroscopic[:2, :2] = GYROSCOPIC
    speeds = np.linspace(0.0, 100.0, 21)
    lines = tracked(mass, [eigenmodes(mass, stiffness, speed * gyroscopic) for speed in speeds])
    omega = np.array([modes.omega for modes in lines])
    whirls = np.sqrt(speeds**2 / 4 + 1e4)[:, None] + speeds[:, None] / 2 * np.array([-1, 1])
    assert omega[:, 2] == pytest.approx(np.full(21, 1.3e4**0.5), rel=1e-12)
    assert np.sort(omega[:, :2], axis=1) == pytest.approx(whirls, rel=1e-12)
