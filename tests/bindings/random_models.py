"""Random mechanisms through the Python wrapper and FMUs of both versions, against lamc's interpreter:

    random_models.py [COUNT [FIRST SEED]]
"""

import ctypes
import subprocess
import sys

import fmpy
import numpy as np

from common import LAMC, WORK, evaluated, relative, within
from fmu import unpacked
from wrapper import closed_states, written

# Largest relative difference of accelerations: sines and cosines differ in the last place, and constraints
# that are nearly dependent make more of it.
ACCELERATION = 1e-9
ENERGY = 1e-10
STATES = 4
GUESSES = 40


def model(seed):
    """The file of a random mechanism."""
    folder = WORK / "random"
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"varied{seed}.yaml"
    text = subprocess.run([LAMC.with_name("varied"), str(seed)], check=True, stdout=subprocess.PIPE).stdout
    path.write_bytes(text)
    return path


def wrapper(path, rng):
    """The largest error of the wrapper, and the closed states that it found with the model's own numbers."""
    mechanism = written(path, "f64")
    states = closed_states(mechanism, rng, STATES, GUESSES)
    worst = 0.0
    expected = evaluated(path, states) if states else []
    for state, values in zip(states, expected):
        robot = mechanism(state["params"], **state["inputs"])
        q, u, t = np.array(state["q"]), np.array(state["u"]), state["t"]
        error = relative(robot.acceleration(q, u, t), values["acceleration"])
        worst = max(worst, within(f"{path.stem}: acceleration in Python", error, ACCELERATION))
        energies = np.array(robot.energy(q, u, t))
        known = np.array([values["kinetic_energy"], values["potential_energy"]])
        within(f"{path.stem}: energies in Python", relative(energies, known), ENERGY)
    return worst, states


def derivatives(folder, version, states):
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
    count = len(names)
    rates = fmu.getDerivatives if version == 2 else fmu.getContinuousStateDerivatives
    found = []
    for state in states:
        x, dx = (ctypes.c_double * count)(), (ctypes.c_double * count)()
        for index, name in enumerate(names):
            joint, letter = name.removeprefix("joints.").rsplit(".", 1)
            x[index] = state[letter][state["joints"].index(joint)]
        fmu.setTime(state["t"])
        fmu.setContinuousStates(x, count)
        rates(dx, count)
        by_name = dict(zip(names, dx))
        found.append([by_name[f"joints.{joint}.u"] for joint in state["joints"]])
    fmu.terminate()
    fmu.freeInstance()
    return found


def fmus(path, states):
    """The largest error of the FMUs of both versions, at the states with the model's own numbers."""
    joints = list(written(path, "f64").JOINTS)
    plain = [{"t": state["t"], "q": state["q"], "u": state["u"], "joints": joints} for state in states]
    expected = evaluated(path, [{key: state[key] for key in ("t", "q", "u")} for state in plain])
    worst = 0.0
    for version in (2, 3):
        for found, values in zip(derivatives(unpacked(path, version), version, plain), expected):
            error = relative(found, values["acceleration"])
            worst = max(worst, within(f"{path.stem}: acceleration, FMI {version}", error, ACCELERATION))
    return worst


def main():
    count, first = [int(word) for word in sys.argv[1:3]] + [3, 1][len(sys.argv[1:3]) :]
    rng = np.random.default_rng(first)
    compared, seed = 0, first
    while compared < count:
        assert seed < first + 3 * count + 5, "hardly any model could be compared"
        path, seed = model(seed), seed + 1
        try:
            python, states = wrapper(path, rng)
        except subprocess.CalledProcessError:
            continue  # lamc refuses some models, and says why
        # A driven joint follows inputs, a tunable one its parameters: the states fit other numbers.
        if not states or states[0]["params"] or any(states[0]["inputs"].values()):
            states = closed_states(written(path, "f64"), rng, STATES, GUESSES, plain=True)
        if not states:
            continue
        print(f"{path.stem}: Python {python:.1e}, FMUs {fmus(path, states):.1e}", flush=True)
        compared += 1


if __name__ == "__main__":
    main()
