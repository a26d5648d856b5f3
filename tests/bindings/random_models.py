"""Random mechanisms through the Python wrapper and FMUs of both versions, against Newton's and Euler's equations in
maximal coordinates:

    random_models.py [COUNT [FIRST SEED]]
"""

import concurrent.futures
import ctypes
import json
import subprocess
import sys

import fmpy
import numpy as np

from common import LAMC, WORK, relative, within
from fmu import unpacked
from wrapper import written

# Errors of accelerations relative to the largest, over the condition number of the hinges' equations.
ACCELERATION = 1e-9
ENERGY = 1e-10
STATES = 4


def varied(*arguments):
    """What the program prints that writes random mechanisms, or nothing if lamc refuses the model."""
    command = [LAMC.with_name("varied"), *map(str, arguments)]
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    return done.stdout if done.returncode == 0 else None


def model(seed):
    """The file of a random mechanism, and closed states of it; no states where none can be compared."""
    folder = WORK / "random"
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"varied{seed}.yaml"
    path.write_text(varied(seed))
    return path, json.loads(varied(seed, "--states", STATES) or "[]")


def error(found, state):
    """Of an acceleration."""
    difference = np.abs(np.asarray(found) - np.array(state["acceleration"])).max()
    return difference / state["magnitude"] / state["condition"] if difference else 0.0


def wrapper(path, states):
    """The largest error of the wrapper."""
    mechanism = written(path, "f64")
    worst = 0.0
    for state in states:
        robot = mechanism(**state["inputs"])
        q, u, t = np.array(state["q"]), np.array(state["u"]), state["t"]
        off = error(robot.acceleration(q, u, t), state)
        worst = max(worst, within(f"{path.stem}: acceleration in Python", off, ACCELERATION))
        off = relative(np.array(robot.energy(q, u, t)), state["energies"])
        within(f"{path.stem}: energies in Python", off, ENERGY)
    return worst, mechanism.JOINTS


def derivatives(folder, version, states, joints):
    """du/dt of an FMU for Model Exchange at some states, by joint."""
    description = fmpy.read_model_description(str(folder))
    fmu = fmpy.instantiate_fmu(str(folder), description, fmi_type="ModelExchange")
    if version == 2:
        fmu.setupExperiment(startTime=0.0)
    fmu.enterInitializationMode()
    fmu.exitInitializationMode()
    (fmu.newDiscreteStates if version == 2 else fmu.updateDiscreteStates)()
    fmu.enterContinuousTimeMode()
    names = [unknown.variable.derivative.name for unknown in description.derivatives]
    references = {variable.name: variable.valueReference for variable in description.modelVariables}
    count = len(names)
    rates = fmu.getDerivatives if version == 2 else fmu.getContinuousStateDerivatives
    give = fmu.setReal if version == 2 else fmu.setFloat64
    found = []
    for state in states:
        x, dx = (ctypes.c_double * count)(), (ctypes.c_double * count)()
        for index, name in enumerate(names):
            joint, letter = name.removeprefix("joints.").rsplit(".", 1)
            x[index] = state[letter][joints.index(joint)]
        fmu.setTime(state["t"])
        inputs = state["inputs"]
        give([references[f"inputs.{name}"] for name in inputs], list(inputs.values()))
        fmu.setContinuousStates(x, count)
        rates(dx, count)
        by_name = dict(zip(names, dx))
        found.append([by_name[f"joints.{joint}.u"] for joint in joints])
    fmu.terminate()
    fmu.freeInstance()
    return found


def fmus(path, states, joints):
    """The largest error of the FMUs of both versions."""
    worst, versions = 0.0, (2, 3)
    with concurrent.futures.ThreadPoolExecutor() as both:
        folders = list(both.map(lambda version: unpacked(path, version), versions))
    for version, folder in zip(versions, folders):
        for found, state in zip(derivatives(folder, version, states, joints), states):
            what = f"{path.stem}: acceleration, FMI {version}"
            worst = max(worst, within(what, error(found, state), ACCELERATION))
    return worst


def main():
    count, first = [int(word) for word in sys.argv[1:3]] + [3, 1][len(sys.argv[1:3]) :]
    compared, seed = 0, first
    while compared < count:
        assert seed < first + 3 * count + 5, "hardly any model could be compared"
        (path, states), seed = model(seed), seed + 1
        if not states:
            continue
        python, joints = wrapper(path, states)
        print(f"{path.stem}: Python {python:.1e}, FMUs {fmus(path, states, list(joints)):.1e}", flush=True)
        compared += 1


if __name__ == "__main__":
    main()
