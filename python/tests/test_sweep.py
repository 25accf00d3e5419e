"""Many scenes on several processes: rows are those of one process, also when a process is killed."""
import os
import pathlib
import signal
import subprocess
import sys

import numpy as np
import pytest

distributed = pytest.importorskip("distributed", reason="python3-distributed isn't installed")
FOLDER = pathlib.Path(os.environ["TACTUS_SOURCE_DIR"]).resolve() / "python/examples"


def test_a_killed_worker_loses_nothing(monkeypatch):
    monkeypatch.syspath_prepend(str(FOLDER))
    monkeypatch.setenv("PYTHONPATH", f"{FOLDER}:{os.path.abspath(os.environ['PYTHONPATH'])}")  # of the workers
    import sweep

    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster, \
            distributed.Client(cluster) as client:
        killed = list(client.run(os.getpid).values())[0]
        distributed.get_client().loop.call_later(0.5, os.kill, killed, signal.SIGKILL)
        table = sweep.sweep(client, 12)
        assert killed not in client.run(os.getpid).values(), "it was killed"
    rows = np.array([sweep.press(*scene) for scene in sweep.scenes(12)], dtype=sweep.TABLE)
    assert (table == rows).all() and len(set(table["state_hash"])) == 12


def test_the_example_writes_its_table(tmp_path):
    path = f"{FOLDER}:{os.path.abspath(os.environ['PYTHONPATH'])}"
    subprocess.run([sys.executable, FOLDER / "sweep.py", tmp_path / "t.npy", "--scenes", "4"], check=True, stdout=subprocess.DEVNULL,
                   env=os.environ | {"PYTHONPATH": path}, timeout=120)
    table = np.load(tmp_path / "t.npy")
    assert len(table) == 4 and (np.diff(table["most_N"]) > 0).all(), "stiffer tissue pushes back more"
