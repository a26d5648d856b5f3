"""Compares lamc with CasADi, MuJoCo and Pinocchio in one run: all results must agree, then all are timed in turns.

    compare.py LAMC PEERS [--quick] [--document] [--contacts] [--gradient] [--sheets]

LAMC is the compiler, PEERS the program that exports models. Results go to target/peers/results.json
and, as text, to standard output; --document puts them into docs/PERFORMANCE.md and draws its plots.
--quick takes few mechanisms and short batches, --contacts only robots on the ground, --gradient only the gradient of a motion,
--sheets only sheets. Times are processor time of this thread.
"""

import argparse
import json
import os
import platform
import re
import statistics
import sys
import time

import bound
import contacts
import gradient
import numpy as np
import peers as p
import report
from model import Model
from timing import measured

CHAINS = [1, 2, 3, 6, 12, 24, 48, 96]
# Kind, rows, columns.
SHEETS = [("miura", n, n) for n in (3, 4, 6, 8, 12, 20)] + [
    ("yoshimura", rows, columns) for rows, columns in ((4, 5), (6, 6), (8, 8), (12, 12))
]
STATES = 64
# Of sheets, few: those of the largest take seconds each.
STATES_OF_SHEETS = 8
# Other functions of lamc's module. Derivatives of sheets are full matrices.
OWN = ("chained_accelerations", "rk4_steps", "rodas_steps", "jacobians")
OWN_OF_SHEETS = ("rk4_steps",)
# CasADi's factored chains grow as n^3, and gcc's time grows as the square of that: gcc cannot compile longer chains.
LARGEST_FACTORED = 24


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("lamc")
    parser.add_argument("peers")
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--document", action="store_true")
    parser.add_argument("--contacts", action="store_true")
    parser.add_argument("--gradient", action="store_true")
    parser.add_argument("--sheets", action="store_true")
    options = parser.parse_args()
    if platform.machine() != "x86_64":
        sys.exit("the bound and the clock are those of x86-64: nothing is compared here")
    p.WORK.mkdir(parents=True, exist_ok=True)
    if options.gradient:
        gradient.compare(options)
        return
    p.native("build", "-p", "lamc-runtime", "--features", "std")
    profile = "users (release)" if "release" in options.lamc else "development"
    results = {"machine": {**machine(), "profile": profile, "clock": clock()}}
    results["sheets"] = {} if options.quick or options.contacts else measured_of(sheets(options), options)
    # MuJoCo's loops are soft, and lcaba may need more iterations than it gets.
    print("\n".join(different(results["sheets"])))
    if options.sheets:
        print("\n" + report.sheets(results))
        if options.document:
            report.replace(results, [report.sheets])
            report.plot_sheets(results)
        return
    results["contacts"] = contacts.compare(options)
    if options.contacts:
        print("\n" + report.contacts(results))
        if options.document:
            report.replace(results, [report.contacts])
        return
    gradient.compare(options)
    results["mechanisms"] = measured_of(mechanisms(options), options)
    results["lanes"] = {} if options.quick else lanes()
    (p.WORK / "results.json").write_text(json.dumps(results, indent=1) + "\n")
    print("\n" + report.tables(results))
    if options.document:
        report.document(results)
    if refused := different(results["mechanisms"]):
        sys.exit("\n".join(refused))


def different(found):
    """Which programs differ too much to be timed."""
    return [
        f"{name}: {label} differs from lamc by {error:.1e} and was not timed"
        for name, mechanism in found.items()
        for label, error in mechanism["refused"].items()
    ]


def mechanisms(options):
    """Names of mechanisms, and where their models are."""
    found = [("sixbar", p.WORKSPACE / "examples" / "sixbar.yaml")]
    for n in [6, 12] if options.quick else CHAINS:
        path = p.WORK / f"chain{n}.yaml"
        path.write_text(p.output(options.peers, "chain", n))
        found.append((path.stem, path))
    return found


def sheets(options):
    """As `mechanisms`, of sheets."""
    found = []
    for kind, rows, columns in SHEETS:
        path = p.WORK / f"{kind}{rows}x{columns}.yaml"
        path.write_text(p.output(options.peers, kind, rows, columns))
        found.append((path.stem, path))
    return found


def measured_of(models, options):
    """What is measured of each of these models, by its name."""
    results = {}
    for name, path in models:
        results[name] = mechanism(name, path, options)
        print(report.line(name, results[name]), flush=True)
    return results


def mechanism(name, path, options):
    """Builds, checks and times all programs that support this mechanism."""
    exported = p.WORK / f"{name}.json"
    is_sheet = name.startswith(("miura", "yoshimura"))
    states = STATES_OF_SHEETS if is_sheet else STATES
    exported.write_text(p.output(options.peers, "export", path, states))
    model = Model(exported)
    extras = OWN_OF_SHEETS if is_sheet else OWN
    own = p.Lamc(options.lamc, name, path)
    entries = {"lamc": (own.peer(model), {})}
    entries |= p.casadi_peers(name, exported, LARGEST_FACTORED)
    entries |= p.mujoco_peers(name, exported)
    entries |= p.pinocchio_peers(name, exported, options.quick)
    errors = {label: peer.error(model) for label, (peer, _) in entries.items()}
    refused = {label: e for label, e in errors.items() if not e <= entries[label][0].tolerance}
    agreeing = {label: entry for label, entry in entries.items() if label not in refused}
    if "lamc" in refused:
        sys.exit(f"{name}: the compiled module differs from its interpreter")
    functions = {label: peer for label, (peer, _) in agreeing.items()}
    functions |= {extra: own.other(model, extra) for extra in extras}
    times = measured(functions, model, options.quick)
    base = np.array(times["lamc"])
    # The bound is for the six-bar: functions of chains are split into parts, sheets are solved by loops.
    is_single = len(model.loops) == 1
    instructions = bound.disassembled(own.path, "::write_acceleration") if is_single else []
    return {
        "n": model.n,
        "loops": len(model.loops),
        "states": len(model.q),
        "derivation_s": own.derivation,
        "compilation_s": own.compilation,
        "module_bytes": own.bytes,
        "instructions": bound.counts(instructions),
        "mca": bound.mca(instructions) if instructions else None,
        "refused": refused,
        "operations": report.operations(p.output(options.lamc, "check", path)),
        "peers": {
            label: {
                "ns": statistics.median(times[label]),
                "ratio": float(np.median(np.array(times[label]) / base)),
                "difference": errors[label],
                **more,
            }
            for label, (_, more) in agreeing.items()
        },
        "lamc": {
            extra: {
                "ns": statistics.median(times[extra]),
                "ratio": float(np.median(np.array(times[extra]) / base)),
            }
            for extra in extras
        },
    }


def lanes():
    """How much faster a lane of four is than the scalar six-bar: acceleration, step."""
    printed = p.native("run", "-p", "lamc-generated", "--features", "simd", "--example", "lanes")
    cells = re.search(r"^\| six-bar \| 4 of `f64` \|(.*)\|$", printed, re.MULTILINE)[1].split("|")
    return {"acceleration": float(cells[2]), "step": float(cells[5])}


def machine():
    """The processor as the kernel describes it, and the compilers."""
    cpu = {}
    with open("/proc/cpuinfo") as info:
        for line in info:
            key, _, value = line.partition(":")
            cpu.setdefault(key.strip(), value.strip())
    first = lambda *command: p.output(*command).splitlines()[0]
    flags = [flag for flag in ("avx2", "fma", "avx512f") if flag in cpu.get("flags", "").split()]
    return {
        "processor": f"{cpu.get('vendor_id', '?')} {cpu.get('model name', '?')}",
        "family": f"{cpu.get('cpu family', '?')}, model {cpu.get('model', '?')}",
        "flags": flags,
        "processors": os.cpu_count(),
        "kernel": os.uname().release,
        "compilers": [first("rustc", "--version"), first("gcc", "--version")],
        "python": sys.version.split()[0],
        "packages": versions(),
        "load": os.getloadavg()[0],
        "date": time.strftime("%Y-%m-%d"),
    }


def versions():
    from importlib.metadata import PackageNotFoundError, version

    found = {}
    for package in ("casadi", "mujoco", "pin"):
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            continue
    return found


def clock():
    """Clock rate under load, GHz: products that wait for each other take three cycles each. (Some processors do additions of
    constants in no time.)"""
    source, library = p.WORK / "clock.c", p.WORK / "libclock.so"
    source.write_text(
        "long products(long n) { long x = n;"
        ' for (long i = 0; i < n; i++) __asm__ volatile("'
        + "imul $3, %0, %0\\n" * 100
        + '" : "+r"(x)); return x; }\n'
    )
    p.run("gcc", *p.C_FLAGS, source, "-o", library)
    products = p.ctypes.CDLL(str(library)).products
    count = 100_000

    def sample():
        begin = time.thread_time_ns()
        products(p.ctypes.c_long(count))
        return 300 * count / (time.thread_time_ns() - begin)

    return statistics.median(sample() for _ in range(15))


if __name__ == "__main__":
    main()
