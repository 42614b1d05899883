"""The benchmark itself: errors fall where they should."""

import benchmark
import pytest


@pytest.mark.slow
def test_benchmark_shows_that_finer_is_better(tmp_path):
    numbers = benchmark.main(tmp_path, quick=True)
    resolved = [error for _, error, *_ in numbers["STE"]["resolved"]]
    assert resolved == sorted(resolved, reverse=True)
    assert resolved[-1] < 0.2
    planar, spatial = (numbers["run-up"][name][0][1] for name in ("planar on bearings", "in space on bearings"))
    assert planar == pytest.approx(spatial, rel=1e-2)
    assert numbers["run-up"]["trapezoidal rule"][0][1] > 10 * numbers["run-up"]["spinning"][0][1]
    assert (tmp_path / "benchmark.png").stat().st_size > 10_000
