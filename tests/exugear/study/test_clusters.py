"""Sweeps, tolerances and parts of a run on processes and on a cluster of Dask."""

import os
import sys
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context

import pytest
import scipy
import studies
import xarray as xr
from executors import RUN, assert_equal
from relieved_pairs import loudness
from scenes import smooth_box

import exugear
from fem.units import um


@pytest.mark.slow
def test_processes_and_a_cluster_of_dask_give_the_same(tmp_path, monkeypatch):
    """Each process draws by the seeds of its cases, and reads compliances from the cache that the nominal case filled.

    Two parts of a run share a process of the cluster.
    """
    from distributed import Client, LocalCluster  # an import of seconds

    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(sys.path))
    normal = scipy.stats.norm
    tolerances = {"C_a": normal(10 * um, 2 * um), "misalignment": normal(0, 1e-4)}
    levels = [{"level": float(k)} for k in range(20)]
    studied = {
        20: partial(exugear.sweep, studies.noisy, levels, seed=4, progress=False),
        12: partial(exugear.monte_carlo, loudness, tolerances, number=12, seed=2, progress=False),
    }
    model, options = exugear.build(smooth_box()), RUN | {"duration": 10.0}
    here, serial = {number: study() for number, study in studied.items()}, exugear.run_up(model, **options).data
    with (
        ProcessPoolExecutor(2, mp_context=get_context("spawn")) as processes,
        LocalCluster(n_workers=2, threads_per_worker=2, dashboard_address=":0") as cluster,
        Client(cluster) as client,
    ):
        for name, executor in {"processes": processes, "dask": client.get_executor()}.items():
            for number, study in studied.items():
                store = tmp_path / f"{number} on {name}"
                xr.testing.assert_identical(study(executor=executor, store=store), here[number])
                assert len(list(store.glob("*.nc"))) == number
        parts = exugear.run_up(model, **options, executor=client.get_executor()).data
    assert_equal(serial, parts)
