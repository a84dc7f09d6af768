"""Where jobs run: what a text names, what is missing, and Slurm's jobs behind the interface of concurrent.futures."""

import sys
from concurrent.futures import Executor

import pytest
from calmotion.errors import ShotError
from calmotion.host import SettingError
from calmotion.workflow.batch import backends
from calmotion.workflow.batch.backends import LocalBackend, SubmititExecutor, backend_for


def test_the_default_is_one_worker_for_each_processor(tmp_path):
    backend = backend_for("local", 3, str(tmp_path))
    assert isinstance(backend, LocalBackend) and backend.limit == 3 and isinstance(backend._executor, Executor)
    backend.close()


@pytest.mark.parametrize("text", ["cloud", "dask", "dask://", "ssh://host"])
def test_a_place_that_is_not_known_is_refused(tmp_path, text):
    with pytest.raises(SettingError, match="--on"):
        backend_for(text, None, str(tmp_path))


@pytest.mark.parametrize(("on", "package"), [("dask://localhost:1", "distributed"), ("slurm", "submitit")])
def test_a_missing_library_is_named_with_its_extra(tmp_path, monkeypatch, on, package):
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(ShotError, match=r"pip install 'calmotion\["):
        backend_for(on, None, str(tmp_path))


def test_slurm_without_slurm_is_refused(tmp_path, monkeypatch):
    pytest.importorskip("submitit")
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(ShotError, match="sbatch"):
        backend_for("slurm", None, str(tmp_path))


def test_jobs_of_submitit_are_futures(tmp_path, monkeypatch):
    submitit = pytest.importorskip("submitit")
    monkeypatch.setattr(backends, "_POLL", 0.02)
    executor = SubmititExecutor(submitit.AutoExecutor(folder=tmp_path, cluster="debug"))
    assert executor.submit(divmod, 7, 2).result(timeout=600) == (3, 1)
    executor.shutdown()


def test_a_job_of_submitit_that_is_lost_is_a_future_with_an_error(monkeypatch):
    monkeypatch.setattr(backends, "_POLL", 0.02)

    class Lost:
        cancelled = False

        def submit(self, function, *arguments):
            return self

        def done(self):
            return True

        def result(self):
            raise RuntimeError("the node is gone")

        def cancel(self, check):
            self.cancelled = True

    executor = SubmititExecutor(Lost())
    with pytest.raises(RuntimeError, match="the node is gone"):
        executor.submit(divmod, 7, 2).result(timeout=600)
    executor.shutdown(cancel_futures=True)
