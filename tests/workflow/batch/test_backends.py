"""Where jobs run: what a text names, and what is missing."""

import sys
from concurrent.futures import Executor

import pytest
from calmotion.errors import ShotError
from calmotion.host import SettingError
from calmotion.workflow.batch.backends import LocalBackend, backend_for


def test_the_default_is_one_worker_for_each_processor():
    backend = backend_for("local", 3)
    assert isinstance(backend, LocalBackend) and backend.limit == 3 and isinstance(backend._executor, Executor)
    backend.close()


@pytest.mark.parametrize("text", ["cloud", "dask", "dask://", "ssh://host"])
def test_a_place_that_is_not_known_is_refused(text):
    with pytest.raises(SettingError, match="--on"):
        backend_for(text, None)


@pytest.mark.parametrize("text", ["slurm", "slurm?slurm_partition=cpu"])
def test_slurm_is_reached_through_dask(text):
    with pytest.raises(SettingError, match=r"SLURMCluster of dask-jobqueue.*dask://HOST:PORT"):
        backend_for(text, None)


def test_a_missing_library_is_named_with_its_extra(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(ShotError, match=r"pip install 'calmotion\[dask\]'"):
        backend_for("dask://localhost:1", None)
