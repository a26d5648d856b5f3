"""How fast models run from Python: ``python benchmark/rate.py MODEL [--rust RATE] [--peers]``.

``RATE`` is the program ``rate`` (``cargo build --release --example rate``), which calls the same machine code from
Rust. Both take turns, and the best of several runs counts. ``--peers`` compares with SymPy and Pynamics
(``pip install sympy pynamics pyyaml``); the model must be the six-bar then.
"""

import argparse
import subprocess
import tempfile
import time
from pathlib import Path

import numpy as np

import lamc
from lamc import _command

ROWS, RUNS = 1_000_000, 5


def main(path: str, rate: str | None) -> None:
    begin = time.perf_counter()
    model = lamc.load(path)
    loaded = time.perf_counter()
    model.simulate(1.0)
    print(f"load {loaded - begin:.3f} s, simulate 1 s: {time.perf_counter() - loaded:.3f} s")
    q = np.tile(model.assemble()[0], (ROWS, 1))
    u = np.zeros_like(q)
    with tempfile.TemporaryDirectory() as folder:
        derived = Path(folder) / "model.lamc"
        _command.run(["derive", path, "-o", str(derived)])
        ours, others = [], []
        for _ in range(RUNS):
            begin = time.perf_counter()
            model.acceleration(q, u)
            ours.append((time.perf_counter() - begin) / ROWS * 1e9)
            if rate:
                done = subprocess.run([rate, derived, str(ROWS)], capture_output=True, check=True)
                others.append(float(done.stdout))
    print(f"acceleration from NumPy: {min(ours):.0f} ns, {1e3 / min(ours):.2f} million per second")
    if rate:
        print(f"the same machine code from Rust: {min(others):.0f} ns; Python has {min(others) / min(ours):.0%} of its rate")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("model")
    parser.add_argument("--rust", metavar="RATE")
    parser.add_argument("--peers", action="store_true")
    arguments = parser.parse_args()
    main(arguments.model, arguments.rust)
    if arguments.peers:
        from peers import compare

        compare(arguments.model)
