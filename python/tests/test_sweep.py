"""Sweeps against closed forms and the command; on threads, Ray and Dask, where workers are lost."""

import contextlib
import hashlib
import os
import signal
import subprocess
import threading
import time
from pathlib import Path

import numpy as np
import psutil
import pytest
from numpy.testing import assert_allclose
from scipy import stats

import lamc
from lamc import _command

ROD = """
name: rod
gravity: [0, 0, 0]
units: { angle: deg }
parameters: { k: 1e-3, b: 4e-6 }
inputs: [motor]
bodies:
  base: { fixed: true }
  rod: { mass: 2 g, com: [0, -0.02, 0], inertia: [[3e-7, 0, 0], [0, 1e-9, 0], [0, 0, 3e-7]] }
joints:
  hinge: { bodies: [base, rod], axis: [[0, 0], [1, 0]], stiffness: k, damping: b, torque: motor }
initial: { q: { hinge: 20 } }
"""
INERTIA = 3e-7 + 0.002 * 0.02**2

PLAN = """
vary:
  k: { normal: 5% }
  initial.hinge: { uniform: [10, 30deg] }
samples: { count: 3000, method: latin_hypercube }
duration: 1 s
"""


@pytest.fixture(scope="session")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the model and the plan."""
    folder = tmp_path_factory.mktemp("command")
    for name, text in (("rod.yaml", ROD), ("plan.yaml", PLAN)):
        (folder / name).write_text(text)
    return folder


@pytest.fixture(scope="session")
def rod(folder: Path) -> lamc.Model:
    return lamc.load(folder / "rod.yaml")


@pytest.fixture(scope="session")
def expected(folder: Path) -> str:
    """What the command writes."""
    lamc_ = [_command.path(), "sweep", "rod.yaml", "plan.yaml", "-o", "out.parquet"]
    subprocess.run(lamc_, cwd=folder, check=True, capture_output=True)
    return digest(folder / "out.parquet")


def digest(file: Path) -> str:
    return hashlib.sha256(file.read_bytes()).hexdigest()


def test_samples_and_equilibria(rod: lamc.Model) -> None:
    plan = {
        "task": "equilibrium",
        "grid": {"input.motor": [0.0, 1e-4]},
        "vary": {"k": {"normal": [1e-3, 1e-4]}, "initial.hinge": {"uniform": [-0.1, 0.1]}},
        "samples": {"count": 1000, "method": "sobol"},
        "record": ["end", "frequencies"],
    }
    rows = lamc.sweep(rod, plan).to_pandas()
    assert len(rows) == 2000 and rows.stable.all() and rows.failure.isna().all()
    assert_allclose(rows["q.hinge"], rows["input.motor"] / rows.k, atol=1e-10)
    frequency = np.array([frequencies[0] for frequencies in rows.frequencies])
    assert_allclose(frequency, np.sqrt(rows.k / INERTIA) / (2 * np.pi), rtol=1e-9)
    # The samples are those of the distributions; angles of a dictionary are in radians.
    drawn = rows[:1000]
    assert stats.kstest(drawn.k, stats.norm(1e-3, 1e-4).cdf).pvalue > 0.05
    assert stats.kstest(drawn["initial.hinge"], stats.uniform(-0.1, 0.2).cdf).pvalue > 0.05
    assert rows.k[:1000].tolist() == rows.k[1000:].tolist()


def test_inputs_and_angles_that_do_not_vary(rod: lamc.Model) -> None:
    plan = {"grid": {"k": [1e-3, 2e-3]}, "duration": 0.3, "record": ["end", "motion"]}
    rows = lamc.sweep(rod, plan, inputs={"motor": 2e-4}, initial={"hinge": 0.1}).to_pandas()
    for run, k in enumerate([1e-3, 2e-3]):
        motion = rod.with_(k=k).simulate(
            0.3, initial={"hinge": 0.1}, inputs={"motor": 2e-4}, tolerance=1e-11
        )
        assert_allclose(rows["motion.t"][run], motion.t, atol=1e-15)
        assert_allclose(rows["motion.q.hinge"][run], motion.q[:, 0], atol=1e-7)
        assert_allclose(rows["q.hinge"][run], motion.q[-1, 0], atol=1e-7)


def test_the_file_is_that_of_the_command(
    tmp_path: Path, rod: lamc.Model, expected: str, capfd: pytest.CaptureFixture[str]
) -> None:
    found = lamc.sweep(rod, PLAN, tmp_path / "out.parquet", progress=True)
    assert digest(tmp_path / "out.parquet") == expected
    assert found.runs == 3000 and found.failures == {}
    assert "3000 runs, 0 failed" in capfd.readouterr().err
    again = lamc.sweep(rod, PLAN, tmp_path / "out.parquet", resume=True)
    assert len(again.to_pandas()) == 3000


def test_an_interrupted_sweep_is_resumed(
    tmp_path: Path, rod: lamc.Model, expected: str
) -> None:
    file = tmp_path / "out.parquet"
    timer = threading.Timer(0.3, os.kill, [os.getpid(), signal.SIGINT])
    timer.start()
    try:
        with pytest.raises(KeyboardInterrupt):
            # Long enough to be interrupted wherever it runs.
            lamc.sweep(rod, PLAN.replace("1 s", "1000 s"), tmp_path / "long.parquet")
    finally:
        timer.cancel()
    with pytest.raises(lamc.Error, match="resume"):
        lamc.sweep(rod, PLAN, tmp_path / "long.parquet")
    timer = threading.Timer(0.2, os.kill, [os.getpid(), signal.SIGINT])
    timer.start()
    try:
        lamc.sweep(rod, PLAN, file)
    except KeyboardInterrupt:
        assert not file.exists()
    finally:
        timer.cancel()
    lamc.sweep(rod, PLAN, file, resume=True)
    assert digest(file) == expected


def test_shards_are_the_whole(tmp_path: Path, rod: lamc.Model) -> None:
    plan = PLAN.replace("3000", "100")
    whole = lamc.sweep(rod, plan).to_pandas()
    begin = 0
    for index in (1, 2, 3):
        rows = lamc.sweep(rod, plan, shard=(index, 3)).to_pandas()
        assert rows.equals(whole[begin : begin + len(rows)])
        begin += len(rows)
    assert begin == 100


def sweep_with_a_loss(name: str, rod: lamc.Model, file: Path, engine: str) -> None:
    """Kills a process below this one, with this in its command line, once some parts are there."""
    killed: list[int] = []
    parts = Path(f"{file}.parts")

    def kill() -> None:
        end = time.monotonic() + 60
        while not killed and time.monotonic() < end:
            time.sleep(0.01)
            if not parts.exists() or len(list(parts.glob("*.parquet"))) < 10:
                continue
            for process in psutil.Process().children(recursive=True):
                with contextlib.suppress(psutil.Error):
                    if name in " ".join(process.cmdline()) and not killed:
                        process.kill()
                        killed.append(process.pid)

    killer = threading.Thread(target=kill)
    killer.start()
    lamc.sweep(rod, PLAN, file, engine=engine, workers=2)
    killer.join()
    assert len(killed) == 1


def test_on_ray_a_lost_worker_changes_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, rod: lamc.Model, expected: str
) -> None:
    import ray

    # Ray looks for modules in the folder where it is started, too.
    monkeypatch.chdir(tmp_path)
    ray.init(num_cpus=2, include_dashboard=False, log_to_driver=False)
    try:
        assert ray.cluster_resources()["CPU"] == 2
        sweep_with_a_loss("ray::_part", rod, tmp_path / "ray.parquet", "ray")
    finally:
        ray.shutdown()
    assert digest(tmp_path / "ray.parquet") == expected


def test_on_dask_a_lost_worker_changes_nothing(
    tmp_path: Path, rod: lamc.Model, expected: str
) -> None:
    from distributed import Client

    with Client(n_workers=2, threads_per_worker=1, dashboard_address=None):
        sweep_with_a_loss("spawn_main", rod, tmp_path / "dask.parquet", "dask")
    assert digest(tmp_path / "dask.parquet") == expected


def test_mistakes(tmp_path: Path, rod: lamc.Model) -> None:
    for plan, said in (
        ({"grid": {"stiffnes": [1]}}, "no quantity `stiffnes`"),
        ("grid:\n  k: [1mm]\n", "-->"),
        ({"vary": {"k": {"normal": "5%"}}}, "`vary` needs `samples`"),
        (tmp_path / "nowhere.yaml", "nowhere.yaml"),
    ):
        with pytest.raises(lamc.Error, match=said):
            lamc.sweep(rod, plan)
    good = {"grid": {"k": [1e-3]}, "duration": 0.01}
    for arguments, said in (
        ({"engine": "slurm"}, "local, ray, dask"),
        ({"shard": (0, 3)}, "shard"),
        ({"workers": 0}, "workers"),
        ({"initial": {"knee": 1.0}}, "knee"),
    ):
        with pytest.raises(lamc.Error, match=said):
            lamc.sweep(rod, good, **arguments)
    with pytest.raises(lamc.Error, match="no folder"):
        lamc.sweep(rod, good, tmp_path / "nowhere/out.parquet")
    found = lamc.sweep(rod, {"grid": {"b": [1e-6, -1.0]}, "duration": 0.01})
    assert sum(found.failures.values()) == 1 and found.to_pandas().failure.notna().sum() == 1
