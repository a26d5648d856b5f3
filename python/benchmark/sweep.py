"""Times sweeps of the six-bar: one thread against all cores, and Ray against threads.

    python sweep.py MODEL [--ray]

MODEL is examples/sixbar_markers.yaml. 10,000 motions of one second, with other stiffnesses and starts; then, with --ray, as many motions
as take 10, 60 and 300 seconds of one core, on Ray and on threads in turn.
"""

import argparse
import os
import resource
import tempfile
import time
from pathlib import Path

import lamc


def plan(count: int) -> dict[str, object]:
    return {
        "vary": {
            "k": {"normal": "10%"},
            "initial.west_south_west": {"uniform": [-0.8, -0.5]},
        },
        "samples": {"count": count, "method": "sobol"},
        "duration": 1.0,
        "record": ["end", "extremes"],
    }


def timed(model: lamc.Model, count: int, **options: object) -> tuple[float, lamc.Sweep, bytes]:
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "sweep.parquet"
        begin = time.perf_counter()
        found = lamc.sweep(model, plan(count), file, progress=False, **options)  # type: ignore[arg-type]
        seconds = time.perf_counter() - begin
        memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        steps = lamc.Sweep(file, found.runs).to_pandas().steps.sum()
        print(
            f"{count} motions, {options}: {seconds:.2f} s, {steps / seconds:.3g} steps per second, "
            f"at most {memory:.0f} MB"
        )
        return seconds, found, file.read_bytes()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("model")
    parser.add_argument("--ray", action="store_true")
    arguments = parser.parse_args()
    model = lamc.load(arguments.model)
    cores = len(os.sched_getaffinity(0))
    timed(model, 500, workers=cores)
    one, _, single = timed(model, 10_000, workers=1)
    all_, _, several = timed(model, 10_000, workers=cores)
    assert single == several
    print(f"{cores} cores are {one / all_:.2f} times as fast as one")
    timed(model, 30_000, workers=cores)
    if not arguments.ray:
        return
    import ray

    begin = time.perf_counter()
    ray.init(num_cpus=cores, include_dashboard=False, log_to_driver=False)
    print(f"Ray starts in {time.perf_counter() - begin:.1f} s")
    for work in (10, 60, 300):
        count = round(10_000 * work / one)
        on_threads, _, local = timed(model, count, workers=cores)
        on_ray, _, remote = timed(model, count, engine="ray")
        assert local == remote
        print(f"{work} s of one core: Ray takes {on_ray / on_threads - 1:+.1%}")


if __name__ == "__main__":
    main()
