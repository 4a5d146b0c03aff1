"""A cluster of two workers, some of which are killed: every bit as on one core, nothing lost, nothing twice."""

import hashlib
import json
import os
import signal
import threading
import time

import numpy as np
import pytest

import penetrode as pn

pytest.importorskip("distributed")
pa = pytest.importorskip("pyarrow")

import pyarrow.parquet as pq  # noqa: E402

import penetrode.dask  # noqa: E402

# What others warn of when their workers are killed.
pytestmark = pytest.mark.filterwarnings("ignore")


def write_scenes(folder, files, rows):
    """Random scenes in Parquet files."""
    for index in range(files):
        chance = np.random.default_rng(index)
        columns = {
            "mass_kg": chance.uniform(0.5, 5, rows),
            "diameter_m": chance.uniform(0.02, 0.1, rows),
            "nose_factor": chance.uniform(0, 1, rows),
            "strength_pa": chance.uniform(2e7, 1e8, rows),
            "density_kg_m3": chance.uniform(2000, 2500, rows),
            "thickness_m": chance.uniform(0.05, 2, rows),
            "velocity_m_s": chance.uniform(10, 900, rows),
        }
        pq.write_table(pa.table(columns), folder / f"{index:03}.parquet")


def digest(paths):
    """Of all results in order."""
    found = hashlib.blake2b(digest_size=16)
    for path in paths:
        table = pq.read_table(path)
        for name in ("row", "depth_m", "time_s", "velocity_m_s", "exit_margin"):
            found.update(table[name].to_numpy().tobytes())
    return found.hexdigest()


def with_kills(tmp_path, files, rows, kills):
    """Solves under a cluster of two, killing a worker now and then; then by one core, and compares."""
    from distributed import Client, LocalCluster

    scenes = tmp_path / "scenes"
    scenes.mkdir()
    write_scenes(scenes, files, rows)
    out = tmp_path / "out"
    killed = []
    with LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
    ) as cluster, Client(cluster) as client:

        def kill():
            # One each time that some more files are whole.
            for number in range(kills):
                while len(list(out.glob("*.parquet"))) < (number + 1) * files // (kills + 2):
                    time.sleep(0.01)
                workers = [worker.process.pid for worker in cluster.workers.values() if worker.process is not None]
                pid = workers[number % len(workers)]
                os.kill(pid, signal.SIGKILL)
                killed.append(pid)

        killer = threading.Thread(target=kill, daemon=True)
        killer.start()
        done = penetrode.dask.batch(scenes, out, client=client)
        killer.join(5)
    assert len(killed) == kills
    assert done.rows == files * rows and len(done.files) == files == len(set(done.files))
    assert sorted(path.name for path in out.iterdir()) == sorted([*(path.name for path in done.files), "index.json"])
    alone = penetrode.dask.batch(scenes, tmp_path / "alone")
    assert [path.name for path in alone.files] == [path.name for path in done.files]
    assert digest(alone.files) == digest(done.files)
    return scenes, out, done


def test_killed_workers_lose_nothing(tmp_path):
    scenes, out, done = with_kills(tmp_path, files=12, rows=20_000, kills=1)
    # A second run finds all done, and one that lost a file makes that one again.
    assert penetrode.dask.batch(scenes, out).new == 0
    before = digest(done.files)
    done.files[3].unlink()
    again = penetrode.dask.batch(scenes, out)
    assert (again.new, digest(again.files)) == (1, before)
    assert json.loads((out / "index.json").read_text()) == [path.name for path in done.files]


@pytest.mark.long
def test_ten_million_scenes_and_three_kills(tmp_path):
    with_kills(tmp_path, files=40, rows=250_000, kills=3)


def test_results_are_those_of_batch(tmp_path):
    write_scenes(tmp_path, 2, 1000)
    done = penetrode.dask.batch([tmp_path / "000.parquet", tmp_path / "001.parquet"], tmp_path / "out", critical=True)
    expected = [pn.batch(pq.read_table(tmp_path / f"{i:03}.parquet"), critical=True) for i in range(2)]
    found = done.to_arrow()
    for name in ("depth_m", "critical_velocity_m_s"):
        assert np.array_equal(found[name].to_numpy(), np.concatenate([table[name] for table in expected]))
    other = penetrode.dask.batch(tmp_path / "000.parquet", tmp_path / "out")
    assert other.files[0] not in done.files


def test_a_dask_dataframe(tmp_path):
    dd = pytest.importorskip("dask.dataframe")
    write_scenes(tmp_path, 2, 500)
    frame = dd.read_parquet(tmp_path / "*.parquet")
    done = penetrode.dask.batch(frame, tmp_path / "out")
    assert done.rows == 1000 and len(done.dataframe()) == 1000


def test_a_sweep_and_random_scenes_do_not_depend_on_their_pieces(tmp_path):
    scene = pn.scene("tunnel")
    axes = {"impact.velocity": [100.0, 200.0, 300.0], "target.strength": [30e6, 40e6]}
    done = penetrode.dask.sweep(scene, tmp_path / "a", axes, piece=4)
    assert (done.rows, len(done.files)) == (6, 2)
    depths = done.to_arrow()["depth_m"].to_pylist()
    cases = [(v, s) for v in axes["impact.velocity"] for s in axes["target.strength"]]
    np.testing.assert_allclose(
        depths, [pn.solve(scene.set(velocity=v, strength=s)).depth for v, s in cases], rtol=1e-12
    )
    one = penetrode.dask.monte_carlo(scene, tmp_path / "b", {"target.strength": 0.05}, 1000, piece=400)
    two = penetrode.dask.monte_carlo(scene, tmp_path / "c", {"target.strength": 0.05}, 1000, piece=400)
    assert digest(one.files) == digest(two.files) and one.rows == 1000
    with pytest.raises(pn.OptionError, match="target.colour"):
        penetrode.dask.monte_carlo(scene, tmp_path / "d", {"target.colour": 0.05}, 10)


def test_what_is_not_there_is_said(tmp_path):
    with pytest.raises(pn.TableError, match="no such file"):
        penetrode.dask.batch(tmp_path / "none.parquet", tmp_path / "out")
    (tmp_path / "file").write_text("")
    with pytest.raises(pn.OptionError, match="is a file"):
        penetrode.dask.batch(tmp_path / "none.parquet", tmp_path / "file")
