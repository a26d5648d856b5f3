"""What both tests need: lamc's command, models, and what must hold."""

import csv
import io
import json
import os
import pathlib
import subprocess

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[2]
WORK = ROOT / "target" / "bindings"
CRANK = ROOT / "tests" / "bindings" / "crank.yaml"
JUMPER = CRANK.with_name("jumper.yaml")
TOP = CRANK.with_name("top.yaml")
LAMC = pathlib.Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")) / "debug" / "lamc"


def lamc(*arguments, **options):
    """Runs lamc, and returns what it prints."""
    command = [str(LAMC), *map(str, arguments)]
    return subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True, cwd=ROOT, **options).stdout


def examples():
    return [ROOT / "examples" / f"{name}.yaml" for name in ("pendulum", "triple_pendulum", "fourbar", "sixbar")]


def published():
    """The published mechanisms, with the reference values of their motion."""
    folder = ROOT / "tests" / "data" / "published"
    return [(model, model.with_suffix(".json")) for model in sorted(folder.glob("*.yaml"))]


def simulated(model, *arguments):
    """`lamc simulate` as columns by name without units."""
    text = lamc("simulate", model, "--csv", "-", "--tolerance", "1e-12", *arguments)
    rows = list(csv.reader(io.StringIO(text)))
    return dict(zip((title.split()[0] for title in rows[0]), np.array(rows[1:], float).T))


def evaluated(model, states):
    """`lamc eval` at these states."""
    return json.loads(lamc("eval", model, "--states", "-", input=json.dumps({"states": states})))["states"]


def relative(found, expected):
    """The largest difference by the largest number expected."""
    found, expected = np.asarray(found, float), np.asarray(expected, float)
    if found.shape != expected.shape:
        raise AssertionError(f"shape {found.shape} where {expected.shape} is expected")
    if not found.size:
        return 0.0
    return np.abs(found - expected).max() / max(np.abs(expected).max(), np.finfo(float).tiny)


def within(what, error, bound):
    """Fails when an error is larger than its bound, or no number."""
    if not error <= bound:
        raise AssertionError(f"{what}: {error:.3e}, allowed are {bound:.0e}")
    return error


def refuses(expected, contains, call):
    """Fails unless the call raises this exception with this text."""
    try:
        call()
    except expected as error:
        if contains not in str(error):
            raise AssertionError(f"{error!r} does not say {contains!r}") from error
        return error
    raise AssertionError(f"nothing was raised where {expected.__name__} should be")
