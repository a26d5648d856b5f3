"""The Python wrapper against lamc's interpreter and the published reference values: the C of both
number types, through ctypes."""

import importlib.util
import json
import os
import pathlib
import shutil
import subprocess
import sys

import numpy as np

from common import CRANK, JUMPER, ROOT, TOP, WORK, evaluated, examples, lamc, published, refuses, relative, simulated, within

# Largest relative difference from the interpreter at the same state. In single precision q is that
# of the C, and accelerations lose what the condition of M and J costs.
BOUNDS = {
    "f64": {"equations": 1e-12, "energy": 1e-12, "acceleration": 1e-12, "torque": 1e-12},
    "f32": {"equations": 1e-5, "energy": 1e-5, "acceleration": 1e-4, "torque": 1e-4},
}


def written(model, scalar):
    """The class of a model's wrapper, written by lamc."""
    folder = WORK / scalar
    folder.mkdir(parents=True, exist_ok=True)
    stem = folder / model.stem.split(".")[0].lower()
    files = [f"--{kind}={stem}.{suffix}" for kind, suffix in (("c", "c"), ("header", "h"), ("python", "py"))]
    lamc(model, *files, f"--scalar={scalar}")
    return loaded(pathlib.Path(f"{stem}.py"))


def loaded(path):
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    (found,) = (thing for thing in vars(module).values() if isinstance(thing, type))
    return found


def closed_states(mechanism, rng, spread=0.5):
    """States about the initial one, closed by the C, at random times, parameters (about their values) and inputs."""
    robot = mechanism()
    states = []
    start, _ = robot.initial()
    while len(states) < 12:
        t = rng.uniform(0.0, 2.0)
        values = {name: value * rng.uniform(1 - spread, 1 + spread) for name, value in mechanism.PARAMETERS.items()}
        inputs = {name: rng.uniform(-1e-3, 1e-3) for name in mechanism.INPUTS}
        robot = mechanism(values, **inputs)
        try:
            q = robot.assemble(start + rng.uniform(-0.5, 0.5, mechanism.N), t=t)
            q, u = robot.project(q, rng.uniform(-3.0, 3.0, mechanism.N), t)
        except mechanism.Error:
            continue  # some guesses are out of reach
        states.append({"t": t, "q": q.tolist(), "u": u.tolist(), "params": values, "inputs": inputs})
    return states


def compare(model, mechanism, scalar, states, bounds=None):
    """One call for all rows, against `lamc eval` at each; returns the largest errors."""
    kind, bounds = mechanism.REAL, bounds or BOUNDS[scalar]
    column = lambda key: np.array([state[key] for state in states], kind)
    t, q, u = column("t"), column("q"), column("u")
    values = {
        name: np.array([state[group][name] for state in states], kind)
        for group in ("params", "inputs")
        for name in states[0][group]
    }
    robot = mechanism(values)
    rounded = [
        {**state, "t": float(t[i]), "q": q[i].tolist(), "u": u[i].tolist()}
        | {group: {name: float(values[name][i]) for name in state[group]} for group in ("params", "inputs")}
        for i, state in enumerate(states)
    ]
    expected = evaluated(model, rounded)
    mass, forcing, _, _ = robot.equations(q, u, t)
    kinetic, potential = robot.energy(q, u, t)
    found = [
        ("equations", mass, "mass_matrix"),
        ("equations", forcing, "forcing"),
        ("energy", kinetic, "kinetic_energy"),
        ("energy", potential, "potential_energy"),
        ("acceleration", robot.acceleration(q, u, t), "acceleration"),
    ]
    worst = dict.fromkeys(bounds, 0.0)
    for group, numbers, key in found:
        assert numbers.dtype == kind
        # A vector by its own largest number; energies and torques, single numbers that cross zero,
        # by the largest of all.
        rows = [(numbers, [state[key] for state in expected])]
        if group != "energy":
            rows = zip(numbers, rows[0][1])
        for row, other in rows:
            error = within(f"{model.stem} {scalar} {key}", relative(row, other), bounds[group])
            worst[group] = max(worst[group], error)
    if expected[0]["motor_torques"]:
        driven = [[state["motor_torques"].get(joint, 0.0) for joint in mechanism.JOINTS] for state in expected]
        error = relative(robot.motor_torques(q, u, t), driven)
        worst["torque"] = within(f"{model.stem} {scalar} torque", error, bounds["torque"])
    if scalar == "f64":
        open_by = max(state["closure_residual"] for state in expected)
        within(f"{model.stem}: closure of what the C assembled, m", open_by, 1e-9)
        if mechanism.LOOPS:
            residual, _ = robot.closure(q)
            within(f"{model.stem}: closure, m", np.abs(np.abs(residual).max() - open_by), 1e-15)
    # Rows are independent: one by one they are the same to the last bit.
    one = mechanism({name: value[3] for name, value in values.items()})
    np.testing.assert_array_equal(one.acceleration(q[3], u[3], t[3]), robot.acceleration(q, u, t)[3])
    return worst


def agreement():
    """Interpreter, C f64 and C f32; of the published mechanisms also the reference values."""
    rng = np.random.default_rng(4)
    for model in [*examples(), CRANK]:
        states = closed_states(written(model, "f64"), rng)
        for scalar in ("f64", "f32"):
            report(model, scalar, compare(model, written(model, scalar), scalar, states))
    for model, reference in published():
        expected = json.loads(reference.read_text())["states"]
        states = [{"t": 0.0, "q": s["q"], "u": s["u"], "params": {}, "inputs": {}} for s in expected]
        for scalar in ("f64", "f32"):
            report(model, scalar, compare(model, written(model, scalar), scalar, states))
        robot = written(model, "f64")()
        for state in expected:
            error = relative(robot.acceleration(state["q"], state["u"]), state["acceleration"])
            within(f"{model.stem}: published acceleration", error, 1e-9)
            energies = np.array(robot.energy(state["q"], state["u"]))
            for energy, key in zip(energies, ("kinetic_energy", "potential_energy")):
                within(f"{model.stem}: published {key}", abs(energy / state[key] - 1.0), 1e-9)


def drawing():
    """Lengths as parameters, which rows have for themselves or share: the interpreter, and a point of the drawing."""
    model = ROOT / "examples" / "linkage.yaml"
    linkage = written(model, "f64")
    states = closed_states(linkage, np.random.default_rng(5), 0.07)
    for scalar in ("f64", "f32"):
        report(model, scalar, compare(model, written(model, scalar), scalar, states))
    crank, width = np.array([0.018, 0.018, 0.021]), np.array([0.015, 0.015, 0.025])
    robot = linkage(crank=crank, width=width)
    q, _ = robot.initial()
    rotation, position = (part[:, linkage.BODIES.index("coupler")] for part in robot.poses(q))
    pen = np.stack([crank + linkage.PARAMETERS["coupler"] / 2, 2 * width, 0 * width], axis=-1)
    moved = (rotation @ pen[..., np.newaxis])[..., 0] + position
    np.testing.assert_allclose(robot.points(q)[:, linkage.POINTS.index("pen")], moved, atol=1e-15)


def report(model, scalar, worst):
    print(f"{model.stem} {scalar}: " + ", ".join(f"{key} {error:.1e}" for key, error in worst.items()), flush=True)


def motions():
    """Equal steps against lamc's adaptive integrator, also with parameters that differ by row."""
    sixbar = written(ROOT / "examples" / "sixbar.yaml", "f64")
    t, q, u = sixbar().simulate(0.5, 1e-4)
    expected = simulated(ROOT / "examples" / "sixbar.yaml", "--duration", "0.5")
    for j, joint in enumerate(sixbar.JOINTS):
        error = np.abs(q[::100, j] - expected[f"q.{joint}"]).max()
        within(f"sixbar motion, joint {joint}, rad", error, 1e-8)
    np.testing.assert_allclose(t[::100], expected["t"], rtol=0, atol=1e-12)
    crank = written(CRANK, "f64")
    settings = np.array([0.1, 0.2])
    _, q, _ = crank(amplitude=settings, motor=1e-4, push=1e-3).simulate(1.0, 2e-4)
    assert q.shape == (5001, 2, 5)
    for row, amplitude in enumerate(settings):
        values = ("--set", f"amplitude={amplitude}", "--input", "motor=1e-4", "--input", "push=1e-3")
        expected = simulated(CRANK, "--duration", "1", *values)
        for j, joint in enumerate(crank.JOINTS):
            error = np.abs(q[::50, row, j] - expected[f"q.{joint}"]).max()
            within(f"crank motion, amplitude {amplitude}, joint {joint}, rad", error, 1e-8)


def free():
    """Free bodies: states of plates that jump against the interpreter, and a top that falls against closed forms."""
    for scalar in ("f64", "f32"):
        jumper = written(JUMPER, scalar)
        t, q, u = jumper().simulate(0.03, 1e-4)
        values = {"params": dict(jumper.PARAMETERS), "inputs": dict.fromkeys(jumper.INPUTS, 1e-5)}
        rows = range(0, len(t), 20)
        states = [{"t": float(t[i]), "q": q[i].tolist(), "u": u[i].tolist(), **values} for i in rows]
        # A depth is a difference of lengths, of which single precision knows seven digits.
        bounds = {**BOUNDS[scalar], "equations": 10 * BOUNDS[scalar]["equations"]}
        report(JUMPER, scalar, compare(JUMPER, jumper, scalar, states, bounds))
    robot = written(JUMPER, "f64")(push=1e-5)
    for state, expected in zip(states, evaluated(JUMPER, states), strict=True):
        contacts = robot.contacts(state["q"], state["u"], state["t"])
        due = np.array([expected["contacts"][name] for name in robot.CONTACTS])
        within("jumper: contacts", np.abs(contacts - due).max(), 1e-14)
        momentum = list(expected["momentum"].values())
        within("jumper: momentum", np.abs(robot.momentum(state["q"], state["u"]) - momentum).max(), 1e-14)

    top = written(TOP, "f64")()
    t, q, u = top.simulate(2.0, 1e-4)
    assert q.shape == (20001, top.NQ) and u.shape == (20001, top.NU)
    fall = np.array([1.0, 2.0, 3.0]) + np.outer(t, [0.5, -0.2, 4.0]) - np.outer(0.5 * 9.81 * t**2, [0.0, 0.0, 1.0])
    within("top: parabola, m", np.abs(q[:, :3] - fall).max(), 1e-10)
    within("top: quaternion's length", np.abs(np.linalg.norm(q[:, 3:], axis=1) - 1.0).max(), 1e-15)
    angular = top.momentum(q, u)[:, 2]
    within("top: angular momentum", np.abs(angular / [1.4e-4, 1.0, 6e-3] - [1.0, 0.0, 1.0]).max(), 1e-8)
    refuses(ValueError, "the last axis of q has 7 numbers", lambda: top.acceleration(q[0, :6], u[0]))


def geometry():
    """Poses turn by q about the hinges; points are carried by their bodies."""
    crank = written(CRANK, "f64")
    robot = crank()
    q, _ = robot.initial()
    rotation, position = robot.poses(q)
    top = crank.BODIES.index("top")
    np.testing.assert_allclose(rotation @ np.swapaxes(rotation, -1, -2), np.tile(np.eye(3), (5, 1, 1)), atol=1e-15)
    corner = rotation[top] @ [0.04, 0.0, 0.0] + position[top]
    np.testing.assert_allclose(robot.points(q)[crank.POINTS.index("corner")], corner, atol=1e-15)
    # About +y, so the plate left turns its x axis downwards.
    left = rotation[crank.BODIES.index("left")] @ [1.0, 0.0, 0.0]
    angle = q[crank.JOINTS.index("crank")]
    np.testing.assert_allclose(left, [np.cos(angle), 0.0, -np.sin(angle)], atol=1e-15)
    assert robot.poses(np.zeros((2, 3, 5)))[0].shape == (2, 3, 5, 3, 3)


def misuse():
    """What is wrong is said: names, shapes, rows, compilers; stale libraries are replaced."""
    crank = written(CRANK, "f64")
    robot = crank()
    q, u = robot.initial()
    refuses(KeyError, "there are: k, K, amplitude, motor, push", lambda: crank(stiffness=1.0))
    refuses(ValueError, "one number per joint, 5", lambda: robot.acceleration(q[:4], u))
    error = refuses(crank.Error, "acceleration, row 1: ", lambda: robot.acceleration([q, q * np.nan], u))
    assert (error.row, error.status) == ((1,), 2)
    error = refuses(crank.Error, "step: a time or a step", lambda: robot.step(q, u, np.inf))
    assert (error.row, error.status) == ((), 5)
    refuses(ValueError, "finite", lambda: robot.simulate(1.0, 0.0))

    folder = WORK / "misuse"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    for suffix in ("c", "h", "py"):
        shutil.copy(WORK / "f64" / f"crank.{suffix}", folder)
    script = "import crank; print(crank.Crank().initial()[0][0])"
    run = lambda **env: subprocess.run(
        [sys.executable, "-c", script], cwd=folder, env={**os.environ, **env}, capture_output=True, text=True
    )
    libraries = lambda: {path.name for path in folder.glob("*.so")}
    without = run(PATH=str(folder), CC="")
    assert "needs a C compiler" in without.stderr and not libraries(), without.stderr
    broken = run(CC="cc -DCRANK_H")
    assert "failed:" in broken.stderr and not libraries(), broken.stderr
    assert run().returncode == 0
    (first,) = libraries()
    assert run().returncode == 0 and libraries() == {first}
    source = folder / "crank.c"
    source.write_text(source.read_text() + "/* changed */\n")
    assert run().returncode == 0
    (second,) = libraries()
    assert second != first
    source.unlink()
    assert "crank.c is missing" in run().stderr


if __name__ == "__main__":
    for check in (agreement, drawing, motions, free, geometry, misuse):
        check()
        print(f"{check.__name__}: ok", flush=True)
