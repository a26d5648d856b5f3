"""FMUs of both versions as an importer meets them (fmpy): valid by the schemas, compiled from their
sources, simulated as Model Exchange and as Co-Simulation, with the result of `lamc simulate`."""

import concurrent.futures
import json
import os
import pathlib
import shutil
import subprocess
import sys

import fmpy
import numpy as np
from fmpy.build import build_platform_binary
from fmpy.fmi1 import FMICallException
from fmpy.validation import validate_fmu
from lxml import etree

from common import CRANK, JUMPER, LAMC, ROOT, TOP, WORK, evaluated, lamc, published, refuses, simulated, within

FOLDER = WORK / "fmu"
KINDS = {"CoSimulation": 1e-8, "ModelExchange": 1e-6}
STRICT = ("-std=c99", "-O1", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Werror")


def unpacked(model, version):
    """The FMU that lamc writes, unpacked and built by fmpy."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    path = FOLDER / f"{model.stem.split('.')[0]}_{version}.fmu"
    lamc(model, "--fmu", path, "--fmi", version)
    problems = validate_fmu(str(path))
    if problems:
        raise AssertionError("\n".join([f"{path}:", *problems]))
    folder = path.with_suffix("")
    shutil.rmtree(folder, ignore_errors=True)
    fmpy.extract(path, folder)
    if version == 3:
        schema = pathlib.Path(fmpy.__file__).parent / "schema" / "fmi3" / "fmi3BuildDescription.xsd"
        etree.XMLSchema(etree.parse(schema)).assertValid(etree.parse(folder / "sources" / "buildDescription.xml"))
    for compiler in ("gcc", "clang"):
        if shutil.which(compiler):
            built(folder, compiler, *STRICT, output=os.devnull)
    with open(path.with_suffix(".log"), "w", encoding="utf-8") as log:
        # What cmake says is of interest only when it fails.
        subprocess.run([sys.executable, __file__, "build", folder], check=True, stdout=log, stderr=log)
    return folder


def built(folder, compiler, *options, output):
    sources = sorted((folder / "sources").glob("*.c"))
    subprocess.run([compiler, *options, "-shared", "-fPIC", "-o", output, *sources, "-lm"], check=True)


def variable(column):
    """The variable of an FMU that a column of `lamc simulate` shows, or nothing."""
    letter, _, name = column.partition(".")
    if letter in ("q", "u"):
        body, _, part = name.rpartition(".")
        return f"bodies.{body}.{letter}.{part}" if body else f"joints.{name}.{letter}"
    return f"energy.{column}" if column in ("kinetic", "potential") else None


def compare(model, folder, duration, arguments=(), start_values=None, kinds=None, relative=1e-10):
    """Every coordinate and speed and the energies, over time, against `lamc simulate`."""
    expected = simulated(model, "--duration", str(duration), *arguments)
    for kind, tolerance in (kinds or KINDS).items():
        result = fmpy.simulate_fmu(
            str(folder),
            fmi_type=kind,
            stop_time=duration,
            output_interval=0.01,
            relative_tolerance=relative,
            record_events=False,
            start_values={"solver.step": 1e-4, **(start_values or {})},
            # All others too, as some importers do: to what they are, which must change nothing.
            apply_default_start_values=True,
        )
        np.testing.assert_allclose(result["time"], expected["t"], rtol=0, atol=1e-9)
        worst = 0.0
        for name, numbers in expected.items():
            if not variable(name):
                continue
            found = result[variable(name)]
            scale = max(1.0, np.abs(numbers).max())
            error = np.abs(found - numbers).max() / scale
            worst = max(worst, within(f"{folder.name} {kind} {name}", error, tolerance))
        print(f"{folder.name} {kind}: {worst:.1e}", flush=True)
    return result


def motions(version):
    """With loops, with parameters, inputs, a drive and points, and a published design."""
    sixbar = ROOT / "examples" / "sixbar.yaml"
    folder = unpacked(sixbar, version)
    compare(sixbar, folder, 0.5)
    # Another joint than the model's is held, and those of the model no more.
    compare(sixbar, folder, 0.1, ("--initial", "south_south_east=-0.1rad"), {"joints.south_south_east.q": -0.1})

    folder = unpacked(CRANK, version)
    arguments = [("--set", "amplitude=0.2"), ("--set", "K=1e-3"), ("--input", "motor=1e-4"), ("--input", "push=1e-3")]
    arguments += [("--initial", "flap=0.4rad"), ("--initial", "knee=-0.8rad")]
    values = {"parameters.amplitude": 0.2, "parameters.K": 1e-3, "inputs.motor": 1e-4, "inputs.push": 1e-3}
    values |= {"joints.flap.q": 0.4, "joints.knee.q": -0.8}
    result = compare(CRANK, folder, 1.0, sum(arguments, ()), values)
    derived(result, values)

    for model, reference in published():
        follow(unpacked(model, version), json.loads(reference.read_text())["trajectory"])


def follow(folder, trajectory):
    """A published mechanism from the reference's start, against the reference's motion."""
    description = fmpy.read_model_description(str(folder))
    joints = [v.name[:-2] for v in description.modelVariables if v.name.endswith(".q")]
    values = {f"{joint}.q": q for joint, q in zip(joints, trajectory["q0"])}
    values |= {f"{joint}.u": u for joint, u in zip(joints, trajectory["u0"])}
    times = np.array(trajectory["t"])
    interval = times[1] - times[0]
    for kind in KINDS:
        result = fmpy.simulate_fmu(
            str(folder),
            fmi_type=kind,
            stop_time=times[-1],
            output_interval=interval,
            relative_tolerance=1e-10,
            record_events=False,
            start_values={"solver.step": 2e-5, **values},
        )
        np.testing.assert_allclose(result["time"], times, rtol=0, atol=1e-9)
        found = np.stack([result[f"{joint}.q"] for joint in joints], axis=-1)
        error = np.abs(found - trajectory["q"]).max()
        print(f"{folder.name} {kind}: {within(folder.name, error, 1e-6):.1e} from the reference", flush=True)


def derived(result, values):
    """Accelerations and motor torques against `lamc eval`, points against the loop's geometry."""
    joints = ("crank", "knee", "elbow", "foot", "flap")
    rows = result[::20]
    column = lambda row, letter: [float(row[f"joints.{joint}.{letter}"]) for joint in joints]
    settings = {group: {} for group in ("parameters", "inputs", "joints")}
    for name, value in values.items():
        group, _, name = name.partition(".")
        settings[group][name] = value
    states = [
        {"t": float(row["time"]), "q": column(row, "q"), "u": column(row, "u")}
        | {"params": settings["parameters"], "inputs": settings["inputs"]}
        for row in rows
    ]
    for row, state in zip(rows, evaluated(CRANK, states)):
        scale = np.abs(state["acceleration"]).max()
        error = np.abs(np.array(column(row, "a")) - state["acceleration"]).max() / scale
        within("crank acceleration", error, 1e-12)
        torque = state["motor_torques"]["crank"]
        within("crank motor torque", abs(row["motor.crank"] / torque - 1.0), 1e-9)
        angle = float(row["joints.crank.q"])
        # The knee, 40 mm from the crank's hinge, 0.5 mm below which the corner lies.
        corner = [0.04 * np.cos(angle), -0.04 * np.sin(angle) + 0.5e-3]
        below = angle + float(row["joints.knee.q"])
        corner = np.array(corner) - 0.5e-3 * np.array([np.sin(below), np.cos(below)])
        found = [row["points.corner.x"], row["points.corner.z"]]
        within("corner, m", np.abs(found - corner).max(), 1e-12)


def free(version):
    """A top that falls against closed forms; plates that jump, with contacts and momentum."""
    folder = unpacked(TOP, version)
    for kind, bound in KINDS.items():
        result = fmpy.simulate_fmu(
            str(folder),
            fmi_type=kind,
            stop_time=2.0,
            output_interval=0.01,
            relative_tolerance=1e-10,
            record_events=False,
            # A start value of another length: the same orientation.
            start_values={"solver.step": 1e-4, "bodies.top.q.qw": 2.0},
        )
        t = np.asarray(result["time"])
        column = lambda *names: np.stack([result[name] for name in names], axis=-1)
        axes = lambda name: column(*(f"{name}.{axis}" for axis in "xyz"))
        fall = np.array([1.0, 2.0, 3.0]) + np.outer(t, [0.5, -0.2, 4.0]) - np.outer(0.5 * 9.81 * t**2, [0.0, 0.0, 1.0])
        within(f"{kind}: parabola, m", np.abs(axes("bodies.top.q") - fall).max(), bound)
        within(f"{kind}: centre of mass, m", np.abs(axes("momentum.centre") - fall - [0.1, 0.0, 0.0]).max(), bound)
        # The axis goes around the angular momentum at |L| / I (L. D. Landau, E. M. Lifshitz, Mechanics, section 33).
        momentum = np.array([2e-4 * 0.7, 0.0, 3e-4 * 20.0])
        size = np.linalg.norm(momentum)
        around = momentum / size
        across = np.array([0.0, 0.0, 1.0]) - around[2] * around
        angle = size / 2e-4 * t
        axis = around[2] * around + np.outer(np.cos(angle), across) + np.outer(np.sin(angle), np.cross(around, across))
        w, x, y, z = column(*(f"bodies.top.q.q{part}" for part in "wxyz")).T
        found = np.stack([2 * (x * z + w * y), 2 * (y * z - w * x), w * w - x * x - y * y + z * z], axis=-1)
        within(f"{kind}: axis", np.abs(found - axis).max(), bound)
        within(f"{kind}: quaternion's length", np.abs(w * w + x * x + y * y + z * z - 1.0).max(), 2e-6)
        within(f"{kind}: angular momentum", np.abs(axes("momentum.angular") - momentum).max() / size, bound)
        rate = column(*(f"der(bodies.top.q.q{part})" for part in "wxyz"))
        p, q, r = column(*(f"bodies.top.u.w{axis}" for axis in "xyz")).T
        due = 0.5 * np.stack([-x * p - y * q - z * r, w * p + y * r - z * q, w * q - x * r + z * p, w * r + x * q - y * p], axis=-1)
        within(f"{kind}: rate of the quaternion", np.abs(rate - due).max(), 1e-12)

    # Where a corner touches down, forces have a kink, at which integrators lose their order.
    folder = unpacked(JUMPER, version)
    kinds = {"CoSimulation": 2e-4, "ModelExchange": 1e-3}
    touches(compare(JUMPER, folder, 0.03, (), {"solver.step": 1e-5}, kinds, 1e-7))


def touches(result):
    """Contacts, accelerations and momenta of the plates against `lamc eval` at the states of the FMU."""
    rows = result
    names = lambda letter, parts: ["joints.knee." + letter, "joints.root." + letter] + [
        f"bodies.{body}.{letter}.{part}" for body in ("hull", "chip") for part in parts
    ]
    places, speeds = ("x", "y", "z", "qw", "qx", "qy", "qz"), ("vx", "vy", "vz", "wx", "wy", "wz")
    numbers = lambda row, columns: [float(row[column]) for column in columns]
    states = [
        {"t": float(row["time"]), "q": numbers(row, names("q", places)), "u": numbers(row, names("u", speeds))}
        for row in rows
    ]
    pushed = 0.0
    evaluations = evaluated(JUMPER, states)
    for row, state in zip(rows, evaluations, strict=True):
        scale = np.abs(state["acceleration"]).max()
        error = np.abs(np.array(numbers(row, names("a", speeds))) - state["acceleration"]).max() / scale
        within("jumper: acceleration", error, 1e-12)
        for contact, due in state["contacts"].items():
            found = numbers(row, [f"contacts.{contact}.{part}" for part in ("x", "y", "z", "fx", "fy", "fz")])
            within(f"jumper: contact {contact}", np.abs(np.array(found) - due).max(), 1e-12)
            pushed = max(pushed, due[5])
        momenta = [name for name in row.dtype.names if name.startswith("momentum.")]
        due = np.concatenate([state["momentum"][key] for key in state["momentum"]])
        within("jumper: momentum", np.abs(np.array(numbers(row, momenta)) - due).max(), 1e-12)
    assert pushed > 1e-3, "nothing is touched"


def drift():
    """A careless integrator's drift is put right at events: loops stay closed."""
    sixbar = ROOT / "examples" / "sixbar.yaml"
    result = fmpy.simulate_fmu(
        str(FOLDER / "sixbar_2"), fmi_type="ModelExchange", stop_time=0.5, relative_tolerance=1e-3, output_interval=0.01
    )
    joints = [name[:-2] for name in result.dtype.names if name.endswith(".q")]
    states = [{"q": [float(row[f"{joint}.q"]) for joint in joints]} for row in result]
    open_by = np.array([state["closure_residual"] for state in evaluated(sixbar, states)])
    # At an event there are two samples: before and after.
    before = np.append(np.diff(result["time"]) == 0.0, False)
    assert before.sum() > 10, f"only {before.sum()} events"
    # 1e-6 rad, the tolerance without one of the importer's, at the far end of the mechanism.
    within("sixbar, careless: closure, m", open_by[~before].max(), 1e-6 * 0.3)
    drifted = open_by[before].max()
    assert drifted > open_by[~before].max(), "the integrator is not careless: nothing was put right"
    print(f"drift: up to {drifted:.1e} m, put right to {open_by[~before].max():.1e} m", flush=True)


def calls(version, folder):
    """Saved states, parameters changed between steps, reset, and what must be refused."""
    description = fmpy.read_model_description(str(folder))
    messages = []

    def log(*arguments):
        # The message is last in FMI 3.0; in 2.0 the text of a format.
        messages.append(arguments[4] if two else arguments[3])

    two = version == 2
    fmu = fmpy.instantiate_fmu(str(folder), description, fmi_type="CoSimulation", logger=log)
    references = {variable.name: variable.valueReference for variable in description.modelVariables}
    get, set_ = (fmu.getReal, fmu.setReal) if two else (fmu.getFloat64, fmu.setFloat64)
    save, restore = (fmu.getFMUstate, fmu.setFMUstate) if two else (fmu.getFMUState, fmu.setFMUState)
    free = fmu.freeFMUstate if two else fmu.freeFMUState
    serialize = fmu.serializeFMUstate if two else fmu.serializeFMUState
    deserialize = fmu.deSerializeFMUstate if two else fmu.deserializeFMUState
    everything = [references[name] for name in references]
    flap = [references["joints.flap.q"]]

    def start():
        if two:
            fmu.setupExperiment(startTime=0.0)
            fmu.enterInitializationMode()
        else:
            fmu.enterInitializationMode(startTime=0.0)
        fmu.exitInitializationMode()

    def step(t):
        fmu.doStep(currentCommunicationPoint=t, communicationStepSize=0.1)
        return get(everything)

    # Before initialisation there are start values; within, the loops are closed already.
    assert get(flap) == [np.deg2rad(10.0)]
    start()
    first = get(everything)
    for t in (0.0, 0.1, 0.2):
        step(t)
    saved = save()
    stored = serialize(saved)
    ahead = step(0.3)
    restore(saved)
    assert step(0.3) == ahead, "the state that was saved is not the one that came back"
    free(saved)
    again = deserialize(stored)
    restore(again)
    assert step(0.3) == ahead, "the state that was stored is not the one that came back"
    restore(again)
    free(again)
    set_([references["parameters.k"]], [4e-3])
    assert step(0.3) != ahead, "a parameter that was changed has no effect"
    fmu.reset()
    start()
    assert get(everything) == first, "reset leaves something behind"

    for wrong in (
        lambda: get([9999]),
        lambda: set_([references["time"]], [1.0]),
        lambda: set_([references["joints.flap.a"]], [1.0]),
        lambda: set_(flap, [0.1]),
        lambda: set_([references["parameters.k"]], [np.nan]),
        lambda: set_([references["solver.step"]], [0.0]),
        lambda: set_([references["inputs.push"], references["time"]], [1.0, 1.0]),
        lambda: fmu.doStep(currentCommunicationPoint=0.0, communicationStepSize=-1.0),
        lambda: deserialize(stored[:-1]),
    ):
        refuses(FMICallException, "", wrong)
    # What fails leaves the state as it was.
    assert get(everything) == first
    said = [message.decode() if isinstance(message, bytes) else message for message in messages]
    assert len(said) == 9 and "solver.step must be positive" in said, said
    fmu.terminate()
    fmu.freeInstance()

    description.guid = "{another}"
    description.instantiationToken = "{another}"
    another = lambda: fmpy.instantiate_fmu(str(folder), description, fmi_type="CoSimulation", logger=log)
    refuses(Exception, "nstantiate", another)


def sanitised(version, folder):
    """The same calls, and a simulation of each kind, under the address and undefined sanitizers."""
    library = subprocess.run(["gcc", "-print-file-name=libasan.so"], capture_output=True, text=True).stdout.strip()
    if not os.path.isabs(library):
        print("SKIPPED: gcc's sanitizers are missing; the FMU is NOT CHECKED with them", file=sys.stderr)
        return
    copy = folder.with_name(folder.name + "_sanitised")
    shutil.rmtree(copy, ignore_errors=True)
    shutil.copytree(folder, copy)
    (binary,) = (copy / "binaries").glob("*/*.so")
    built(copy, "gcc", "-std=c99", "-g", "-fsanitize=address,undefined", "-fno-sanitize-recover=all", output=binary)
    environment = {**os.environ, "LD_PRELOAD": library, "ASAN_OPTIONS": "detect_leaks=0"}
    command = [sys.executable, __file__, "calls", str(version), str(copy)]
    subprocess.run(command, check=True, env=environment)


def same_bytes():
    """The same model gives the same file, on standard output too."""
    for version in ("2", "3"):
        command = [LAMC, CRANK, "--fmu", "-", "--fmi", version]
        printed = subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout
        assert printed == (FOLDER / f"crank_{version}.fmu").read_bytes()


def main():
    """All checks, or a part of them in a process of its own."""
    if sys.argv[1:2] == ["build"]:
        build_platform_binary(sys.argv[2], all_warnings=True)
    elif sys.argv[1:2] == ["calls"]:
        calls(int(sys.argv[2]), pathlib.Path(sys.argv[3]))
        for kind in KINDS:
            fmpy.simulate_fmu(sys.argv[3], fmi_type=kind, stop_time=0.05)
    elif sys.argv[1:2] == ["version"]:
        version = int(sys.argv[2])
        motions(version)
        free(version)
        calls(version, FOLDER / f"crank_{version}")
        sanitised(version, FOLDER / f"crank_{version}")
        print(f"FMI {version}: ok", flush=True)
    else:
        part = lambda version: subprocess.run([sys.executable, __file__, "version", version], check=True)
        with concurrent.futures.ThreadPoolExecutor() as both:
            list(both.map(part, ("2", "3")))
        drift()
        same_bytes()


if __name__ == "__main__":
    main()
