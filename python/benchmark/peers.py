"""Accelerations of the six-bar by SymPy and by Pynamics: each derives its own equations, from the outlines, materials and
hinge lines of the model file. No number comes from lamc.

All hinge lines meet in one point, about which every body turns. The loop is cut at one hinge: its angle belongs to a
ghost without mass that must lie as the last body does. Three equations say so; their second derivatives join those of
motion, as in the examples of Pynamics:

    M a - J^T lambda = f,    J a = -gamma
"""

from __future__ import annotations

import logging
import os
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import sympy
import yaml
from sympy.physics import mechanics

import lamc

GRAVITY = 9.81  # m/s^2, along -z
# A body, the one from which it hangs, and the hinge between them; the ghost closes the loop.
CHAIN = [
    ("west", "ground", "ground_west"),
    ("south_west", "west", "west_south_west"),
    ("south", "south_west", "south_west_south"),
    ("east", "ground", "ground_east"),
    ("south_east", "east", "south_east_east"),
    ("ghost", "south_east", "south_south_east"),
]


@dataclass
class Plate:
    """Mass, kg, centre of mass from the common point, m, and inertia about it, kg m^2."""

    mass: float
    com: np.ndarray
    inertia: np.ndarray


@dataclass
class Sixbar:
    """The numbers of the model file, SI."""

    joints: list[str]
    plates: dict[str, Plate]
    axes: dict[str, np.ndarray]
    senses: dict[str, float]
    stiffness: float
    damping: float


def polygon(outline: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
    """Area, centroid, and the integral of x x^T about the origin, by Green's theorem."""
    a, b = outline, np.roll(outline, -1, axis=0)
    cross = a[:, 0] * b[:, 1] - b[:, 0] * a[:, 1]
    area = cross.sum() / 2
    centroid = ((a + b) * cross[:, None]).sum(axis=0) / (6 * area)

    def pair(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        return np.einsum("k,ki,kj->ij", cross, x, y)

    second = (2 * pair(a, a) + 2 * pair(b, b) + pair(a, b) + pair(b, a)) / 24
    sign = np.sign(area)
    return sign * area, centroid, sign * second


def plate(layers: list[Any], layup: list[tuple[float, float]], point: np.ndarray) -> Plate:
    """Of plates of constant thickness, one on top of the other. Lengths in m; ``layup``: density, thickness."""
    mass, first, second, z = 0.0, np.zeros(3), np.zeros((3, 3)), 0.0
    for polygons, (density, thickness) in zip(layers, layup):
        for entry in polygons:
            area, centroid, moments = polygon(np.array(entry["outline"]) * 1e-3 - point[:2])
            low, high = z - point[2], z + thickness - point[2]
            weight = density * area * thickness
            middle = (low + high) / 2
            mass += weight
            first += weight * np.array([*centroid, middle])
            second[:2, :2] += density * thickness * moments
            second[:2, 2] += weight * middle * centroid
            second[2, :2] += weight * middle * centroid
            second[2, 2] += density * area * (high**3 - low**3) / 3
        z += thickness
    com = first / mass
    about = second - mass * np.outer(com, com)
    return Plate(mass, com, np.trace(about) * np.eye(3) - about)


def read(path: str) -> Sixbar:
    """Reads the model file."""
    with open(path, encoding="utf-8") as file:
        model = yaml.safe_load(file)
    materials = model["materials"]
    layup = [(materials[name]["density"], materials[name]["thickness"] * 1e-3) for name in model["layup"]]
    hinges = model["joints"]
    lines = {name: np.array(hinge["axis"], dtype=float) * 1e-3 for name, hinge in hinges.items()}
    height = next(iter(hinges.values()))["z"] * 1e-3
    point = np.array([*next(iter(lines.values()))[0], height])
    assert all((line[0] == point[:2]).all() for line in lines.values())
    axes = {name: (line[1] - line[0]) / np.hypot(*(line[1] - line[0])) for name, line in lines.items()}
    senses = {}
    for body, parent, name in CHAIN:
        # q turns the second body relative to the first.
        first, _ = hinges[name]["bodies"]
        senses[name] = 1.0 if first == parent else -1.0
    [stiffness] = {hinge["stiffness"] for hinge in hinges.values()}
    [damping] = {float(hinge["damping"]) for hinge in hinges.values()}
    bodies = {name: body for name, body in model["bodies"].items() if not body.get("fixed")}
    plates = {name: plate(body["layers"], layup, point) for name, body in bodies.items()}
    return Sixbar(list(hinges), plates, axes, senses, stiffness, damping)


Rates = Callable[[np.ndarray, np.ndarray], np.ndarray]


def by_sympy(sixbar: Sixbar) -> tuple[Rates, Rates]:
    """du/dt by ``KanesMethod`` and ``lambdify``: of one state, and of an array of states, with NumPy's solver."""
    base, still = mechanics.ReferenceFrame("N"), mechanics.Point("C")
    still.set_vel(base, 0)
    q = dict(zip(sixbar.joints, mechanics.dynamicsymbols(f"q:{len(sixbar.joints)}")))
    u = dict(zip(sixbar.joints, mechanics.dynamicsymbols(f"u:{len(sixbar.joints)}")))
    t = mechanics.dynamicsymbols._t
    frames, bodies, loads = {"ground": base}, [], []
    for name, parent, joint in CHAIN:
        x, y = sixbar.axes[joint]
        axis = sixbar.senses[joint] * (x * frames[parent].x + y * frames[parent].y)
        frame = frames[name] = mechanics.ReferenceFrame(name)
        frame.orient_axis(frames[parent], axis, q[joint])
        frame.set_ang_vel(frames[parent], u[joint] * axis)
        torque = (-sixbar.stiffness * q[joint] - sixbar.damping * u[joint]) * axis
        loads += [(frame, torque), (frames[parent], -torque)]
        if name == "ghost":
            continue
        body = sixbar.plates[name]
        centre = still.locatenew(f"{name}_com", sum(c * e for c, e in zip(body.com, frame)))
        centre.v2pt_theory(still, base, frame)
        i = body.inertia
        inertia = mechanics.inertia(frame, i[0, 0], i[1, 1], i[2, 2], i[0, 1], i[1, 2], i[2, 0])
        bodies.append(mechanics.RigidBody(name, centre, frame, body.mass, (inertia, centre)))
        loads.append((centre, -body.mass * GRAVITY * base.z))
    order = list(q.values()), list(u.values())
    kane = mechanics.KanesMethod(base, *order, kd_eqs=[q[j].diff(t) - u[j] for j in q])
    kane.kanes_equations(bodies, loads)
    south, ghost = frames["south"], frames["ghost"]
    closure = sympy.Matrix([south.x.dot(ghost.y), south.y.dot(ghost.z), south.z.dot(ghost.x)])
    jacobian = closure.jacobian(order[0])
    gamma = (jacobian * sympy.Matrix(order[1])).jacobian(order[0]) * sympy.Matrix(order[1])
    # Only numbers and plain symbols from here on.
    plain = {s: sympy.Symbol(f"{s.func}") for s in (*order[0], *order[1])}
    parts = [m.xreplace(plain) for m in (kane.mass_matrix, kane.forcing, jacobian, gamma)]
    arguments = [plain[s] for s in (*order[0], *order[1])]
    single = sympy.lambdify(arguments, parts, cse=True)
    # In one list: of nested ones it shares no subexpressions.
    flat = sympy.lambdify(arguments, [entry for part in parts for entry in part], cse=True)
    n, rows = len(order[0]), 3

    def one(q: np.ndarray, u: np.ndarray) -> np.ndarray:
        mass, forcing, jacobian, gamma = single(*q, *u)
        kkt = np.block([[mass, -jacobian.T], [jacobian, np.zeros((rows, rows))]])
        return np.linalg.solve(kkt, np.concatenate([forcing, -gamma]).ravel())[:n]

    def many(q: np.ndarray, u: np.ndarray) -> np.ndarray:
        found = np.stack([np.broadcast_to(entry, len(q)) for entry in flat(*q.T, *u.T)], axis=-1)
        mass, forcing, jacobian, gamma = np.split(found, np.cumsum([len(part) for part in parts])[:-1], axis=1)
        kkt = np.zeros((len(q), n + rows, n + rows))
        kkt[:, :n, :n] = mass.reshape(-1, n, n)
        kkt[:, n:, :n] = jacobian.reshape(-1, rows, n)
        kkt[:, :n, n:] = -kkt[:, n:, :n].transpose(0, 2, 1)
        return np.linalg.solve(kkt, np.concatenate([forcing, -gamma], axis=1)[..., None])[:, :n, 0]

    return one, many


def by_pynamics(sixbar: Sixbar) -> Rates:
    """du/dt by Pynamics' own function for integrators (``state_space_post_invert``), of one state."""
    here = os.getcwd()
    with tempfile.TemporaryDirectory() as folder:
        # It writes a log into the current folder.
        os.chdir(folder)
        import pynamics
        from pynamics.body import Body
        from pynamics.constraint import AccelerationConstraint
        from pynamics.dyadic import Dyadic
        from pynamics.frame import Frame
        from pynamics.system import System
        from pynamics.variable_types import Differentiable

        os.chdir(here)
    logging.getLogger("pynamics").setLevel(logging.ERROR)
    system = System()
    pynamics.set_system(__name__, system)
    q = {joint: Differentiable(f"q{k}", system)[:2] for k, joint in enumerate(sixbar.joints)}
    frames = {"ground": Frame("N", system)}
    base = frames["ground"]
    system.set_newtonian(base)
    for name, parent, joint in CHAIN:
        angle, speed = q[joint]
        x, y = (float(c) for c in sixbar.senses[joint] * sixbar.axes[joint])
        frame = frames[name] = Frame(name, system)
        frame.rotate_fixed_axis(frames[parent], [x, y, 0], angle, system)
        torque = -sixbar.stiffness * angle - sixbar.damping * speed
        axis = x * frames[parent].x + y * frames[parent].y
        system.addforce(torque * axis, frames[parent].get_w_to(frame))
        if name == "ghost":
            continue
        body, i = sixbar.plates[name], sixbar.plates[name].inertia
        centre = sum((float(c) * e for c, e in zip(body.com, frame.principal_axes)), 0 * frame.x)
        inertia = Dyadic.build(frame, i[0, 0], i[1, 1], i[2, 2], i[0, 1], i[1, 2], i[2, 0])
        Body(name, frame, centre, body.mass, inertia, system)
    system.addforcegravity(-GRAVITY * base.z)
    south, ghost = frames["south"], frames["ghost"]
    closure = [south.x.dot(ghost.y), south.y.dot(ghost.z), south.z.dot(ghost.x)]
    second = [system.derivative(system.derivative(equation)) for equation in closure]
    system.constraints.append(AccelerationConstraint(second))
    function = system.state_space_post_invert(*system.getdynamics())
    n = len(sixbar.joints)
    # Its state is in the order in which the angles were made.
    return lambda q, u: np.array(function(np.concatenate([q, u]), 0.0)[n:])


def per_call(rates: Callable[[], object], least: float = 1.0) -> float:
    """Seconds of a call: the best of five series, which take at least so long together."""
    begin, calls = time.perf_counter(), 0
    while calls == 0 or time.perf_counter() - begin < least / 5:
        rates()
        calls += 1
    best = np.inf
    for _ in range(5):
        begin = time.perf_counter()
        for _ in range(calls):
            rates()
        best = min(best, (time.perf_counter() - begin) / calls)
    return best


def compare(path: str, rows: int = 5_000) -> None:
    """Checks that all agree, and prints their rates."""
    sixbar, model = read(path), lamc.load(path)
    assert model.joints == sixbar.joints
    random = np.random.default_rng(0)
    guesses = [{"ground_west": angle} for angle in (0.2, 0.3, 0.4)]
    states = []
    for guess in guesses:
        q, _ = model.assemble(guess)
        states.append(model.assemble(q, random.normal(size=len(q))))
    begin = time.perf_counter()
    one, many = by_sympy(sixbar)
    print(f"SymPy derives the equations in {time.perf_counter() - begin:.1f} s")
    begin = time.perf_counter()
    routes = {"SymPy": one, "Pynamics": by_pynamics(sixbar)}
    print(f"Pynamics derives the equations in {time.perf_counter() - begin:.1f} s")
    for q, u in states:
        ours = model.acceleration(q, u)
        theirs = {name: route(q, u) for name, route in routes.items()}
        theirs["SymPy, array"] = many(q[None], u[None])[0]
        for name, found in theirs.items():
            off = np.abs(found - ours).max() / np.abs(ours).max()
            print(f"{name}: differs by {off:.1e}")
            assert off < 1e-9, (name, found, ours)
    q, u = states[0]
    own = per_call(lambda: model.acceleration(q, u))
    print(f"one state a call: lamc {own * 1e6:.1f} us")
    for name, route in routes.items():
        other = per_call(lambda: route(q, u))
        print(f"one state a call: {name} {other * 1e6:.0f} us, {other / own:.0f} times as long")
    q, u = (np.tile(part, (rows, 1)) for part in (q, u))
    own = per_call(lambda: model.acceleration(q, u)) / rows
    other = per_call(lambda: many(q, u)) / rows
    print(f"arrays of {rows} states: lamc {own * 1e9:.0f} ns a state, SymPy with NumPy {other * 1e9:.0f} ns,"
          f" {other / own:.0f} times as long")
