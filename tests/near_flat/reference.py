"""Accelerations next to the flat state in 60 digits, independent of lamc.

    python3 tests/near_flat/reference.py tests/near_flat/states.json MODEL.yaml ..

needs mpmath and PyYAML. Models are named in the output by their paths from the workspace. For every model, states are made at distances of 1e-1 to 1e-6 rad from the
flat state (the largest angle): the model's initial angles, scaled down and closed by Newton's method;
once at rest and once with random speeds along the closure. The mechanism is a tree of bodies without
copies; a hinge that closes a loop carries its spring and damper and nine equations, three points of
its second body; M du/dt = f + J^T lambda and J du/dt = -gamma are solved together by Gaussian
elimination with complete pivoting, which also finds the rank.
"""

import json
import os
import random
import sys

import yaml
from mpmath import mp, mpf, cos, sin, sqrt

mp.dps = 60
# What is smaller than this beside the largest entry is rounding.
NOTHING = mpf(10) ** -35
WORKSPACE = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..")
DISTANCES = ["1e-1", "1e-2", "1e-3", "1e-4", "1e-5", "1e-6"]


def add(a, b):
    return [x + y for x, y in zip(a, b)]


def sub(a, b):
    return [x - y for x, y in zip(a, b)]


def scale(s, a):
    return [s * x for x in a]


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def times(m, v):
    return [dot(row, v) for row in m]


def product(a, b):
    columns = list(zip(*b))
    return [[dot(row, column) for column in columns] for row in a]


def rotation(e, angle):
    """Rodrigues' formula."""
    c, s = cos(angle), sin(angle)
    x, y, z = e
    k = 1 - c
    return [
        [c + k * x * x, k * x * y - s * z, k * x * z + s * y],
        [k * x * y + s * z, c + k * y * y, k * y * z - s * x],
        [k * x * z - s * y, k * y * z + s * x, c + k * z * z],
    ]


def number(value, unit=1):
    """A number of the file, exactly as it is written in decimals."""
    return mpf(str(value)) * unit


class Polygon:
    """Area and moments to the second order, about the origin."""

    def __init__(self, points):
        self.area, self.first, self.second = mpf(0), [mpf(0)] * 2, [mpf(0)] * 3
        for (x0, y0), (x1, y1) in zip(points, points[1:] + points[:1]):
            a = x0 * y1 - x1 * y0
            self.area += a / 2
            self.first[0] += (x0 + x1) * a / 6
            self.first[1] += (y0 + y1) * a / 6
            self.second[0] += (x0 * x0 + x0 * x1 + x1 * x1) * a / 12
            self.second[1] += (y0 * y0 + y0 * y1 + y1 * y1) * a / 12
            self.second[2] += (x0 * y1 + 2 * x0 * y0 + 2 * x1 * y1 + x1 * y0) * a / 24
        if self.area < 0:
            self.area = -self.area
            self.first = scale(-1, self.first)
            self.second = scale(-1, self.second)


class Model:
    def __init__(self, path):
        self.name = os.path.basename(path)
        with open(path) as file:
            text = yaml.safe_load(file)
        units = text.get("units", {})
        self.length = {"mm": mpf(1) / 1000, "m": mpf(1)}[units.get("length", "m")]
        self.angle = {"deg": mp.pi / 180, "rad": mpf(1)}[units.get("angle", "rad")]
        self.gravity = [number(g) for g in text.get("gravity", [0, 0, "-9.81"])]
        layup = [text["materials"][name] for name in text.get("layup", [])]
        self.parameters = text.get("parameters", {})
        self.bodies, self.fixed = {}, set()
        for name, body in text["bodies"].items():
            if body.get("fixed"):
                self.fixed.add(name)
            else:
                self.bodies[name] = self.mass_of(body, layup)
        self.joints = []
        guess = text.get("initial", {}).get("q", {})
        for name, joint in text["joints"].items():
            self.joints.append(self.joint_of(name, joint, guess))
        self.grow()

    def mass_of(self, body, layup):
        """Mass, centre and inertia about the origin of the flat drawing."""
        if "mass" in body:
            mass = number(body["mass"])
            com = [number(x, self.length) for x in body["com"]]
            inertia = [[number(x) for x in row] for row in body["inertia"]]
            square = dot(com, com)
            about = lambda i, k: inertia[i][k] + mass * ((square if i == k else 0) - com[i] * com[k])
            return mass, com, [[about(i, k) for k in range(3)] for i in range(3)]
        layers = body.get("layers") or [[{"outline": body["outline"], "holes": body.get("holes", [])}]] * len(layup)
        mass, moment = mpf(0), [mpf(0)] * 3
        tensor = [[mpf(0)] * 3 for _ in range(3)]  # integral of x x^T dm
        bottom = mpf(0)
        for layer, material in zip(layers, layup):
            density = number(material["density"])
            thickness = number(material["thickness"], self.length)
            top = bottom + thickness
            for shape in layer or []:
                for sign, outline in [(1, shape["outline"])] + [(-1, h) for h in shape.get("holes", [])]:
                    polygon = Polygon([[number(x, self.length) for x in point] for point in outline])
                    height = [top - bottom, (top**2 - bottom**2) / 2, (top**3 - bottom**3) / 3]
                    d = sign * density
                    mass += d * polygon.area * height[0]
                    first = polygon.first
                    moment = add(moment, [d * first[0] * height[0], d * first[1] * height[0], d * polygon.area * height[1]])
                    xx, yy, xy = scale(height[0] * d, polygon.second)
                    xz, yz = d * first[0] * height[1], d * first[1] * height[1]
                    zz = d * polygon.area * height[2]
                    part = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]
                    tensor = [add(a, b) for a, b in zip(tensor, part)]
            bottom = top
        trace = tensor[0][0] + tensor[1][1] + tensor[2][2]
        inertia = [[(trace if i == k else 0) - tensor[i][k] for k in range(3)] for i in range(3)]
        return mass, scale(1 / mass, moment), inertia

    def value(self, text):
        return number(self.parameters.get(text, text) if isinstance(text, str) else text)

    def joint_of(self, name, joint, guess):
        z = number(joint.get("z", 0), self.length)
        a, b = [[number(x, self.length) for x in point] + [z] for point in joint["axis"]]
        along = sub(b, a)
        return {
            "name": name,
            "bodies": joint["bodies"],
            "point": a,
            "axis": scale(1 / sqrt(dot(along, along)), along),
            "stiffness": self.value(joint.get("stiffness", 0)),
            "damping": self.value(joint.get("damping", 0)),
            "rest": number(joint.get("rest", 0), self.angle),
            "guess": number(guess.get(name, 0), self.angle),
        }

    def grow(self):
        """Breadth-first from the ground: (joint, parent, child, sign) of the tree, then the joints that close loops."""
        reached, queue = set(self.fixed), list(self.fixed)
        self.tree, self.closing, seen = [], [], set()
        while queue:
            body = queue.pop(0)
            for index, joint in enumerate(self.joints):
                first, second = joint["bodies"]
                if index in seen or body not in (first, second):
                    continue
                seen.add(index)
                other, sign = (second, 1) if body == first else (first, -1)
                if other in reached:
                    self.closing.append((index, body, other, sign))
                else:
                    reached.add(other)
                    queue.append(other)
                    self.tree.append((index, body, other, sign))

    def move(self, q, u):
        """Per body: rotation, how x = 0 moves, angular velocity and acceleration bias, and the hinges on the way."""
        zero = [mpf(0)] * 3
        identity = [[mpf(int(i == k)) for k in range(3)] for i in range(3)]
        state = {body: (identity, zero, zero, zero, zero, zero, []) for body in self.fixed}
        for index, parent, child, sign in self.tree:
            state[child] = self.through(state[parent], index, sign, q, u)
        return state

    def through(self, parent, index, sign, q, u):
        """The state of a body behind a hinge; each tuple is of the material point drawn at 0."""
        rotation_p, p, v, a, omega, alpha, hinges = parent
        joint = self.joints[index]
        axis = times(rotation_p, joint["axis"])
        turn = rotation(joint["axis"], sign * q[index])
        arm_flat = joint["point"]
        centre = add(times(rotation_p, arm_flat), p)
        rotation_c = product(rotation_p, turn)
        origin = sub(centre, times(rotation_c, arm_flat))
        # The hinge's centre moves with the parent.
        arm = sub(centre, p)
        v_centre = add(v, cross(omega, arm))
        a_centre = add(a, add(cross(alpha, arm), cross(omega, cross(omega, arm))))
        rate = sign * u[index]
        omega_c = add(omega, scale(rate, axis))
        alpha_c = add(alpha, scale(rate, cross(omega, axis)))
        arm = sub(origin, centre)
        v_c = add(v_centre, cross(omega_c, arm))
        a_c = add(a_centre, add(cross(alpha_c, arm), cross(omega_c, cross(omega_c, arm))))
        return rotation_c, origin, v_c, a_c, omega_c, alpha_c, hinges + [(index, scale(sign, axis), centre)]

    def point(self, body, x):
        """World position and acceleration bias of a material point."""
        turn, p, _, a, omega, alpha, _ = body
        arm = times(turn, x)
        return add(p, arm), add(a, add(cross(alpha, arm), cross(omega, cross(omega, arm))))

    def closure(self, state, q, u):
        """Residuals, J and gamma: nine of each loop."""
        residual, jacobian, gamma = [], [], []
        n = len(q)
        for index, body, other, sign in self.closing:
            ghost, original = self.through(state[body], index, sign, q, u), state[other]
            at = self.joints[index]["point"]
            size = mpf(1) / 10
            for x in [at, add(at, [size, 0, 0]), add(at, [0, size, 0])]:
                (there, a), (here, b) = self.point(ghost, x), self.point(original, x)
                columns = [[mpf(0)] * 3 for _ in range(n)]
                for hinges, place, side in [(ghost[6], there, 1), (original[6], here, -1)]:
                    for hinge, axis, centre in hinges:
                        columns[hinge] = add(columns[hinge], scale(side, cross(axis, sub(place, centre))))
                for row in range(3):
                    residual.append(there[row] - here[row])
                    jacobian.append([column[row] for column in columns])
                    gamma.append(a[row] - b[row])
        return residual, jacobian, gamma

    def dynamics(self, state, q, u):
        n = len(q)
        mass = [[mpf(0)] * n for _ in range(n)]
        force = [-j["stiffness"] * (x - j["rest"]) - j["damping"] * v for j, x, v in zip(self.joints, q, u)]
        for name, (m, com, inertia) in self.bodies.items():
            body = state[name]
            turn, origin = body[0], body[1]
            centre, bias = self.point(body, com)
            square = dot(com, com)
            central = [[inertia[i][k] - m * ((square if i == k else 0) - com[i] * com[k]) for k in range(3)] for i in range(3)]
            world = product(product(turn, central), list(zip(*turn)))
            partials = [(h, cross(axis, sub(centre, c)), axis) for h, axis, c in body[6]]
            omega, alpha = body[4], body[5]
            torque = add(times(world, alpha), cross(omega, times(world, omega)))
            push = scale(m, sub(self.gravity, bias))
            for i, v, w in partials:
                force[i] += dot(v, push) - dot(w, torque)
                turned = times(world, w)
                for k, v2, w2 in partials:
                    mass[i][k] += m * dot(v, v2) + dot(turned, w2)
        return mass, force


def independent(rows, right):
    """Gaussian elimination with complete pivoting: the independent rows as eliminated, and what is right of them."""
    rows, right = [list(r) for r in rows], list(right)
    largest = max((abs(x) for row in rows for x in row), default=mpf(0))
    pivots = []
    for step in range(len(rows)):
        best = max(((abs(rows[i][k]), i, k) for i in range(step, len(rows)) for k in range(len(rows[0]))), default=None)
        if best is None or best[0] <= NOTHING * largest:
            break
        _, i, k = best
        rows[step], rows[i] = rows[i], rows[step]
        right[step], right[i] = right[i], right[step]
        for other in range(step + 1, len(rows)):
            factor = rows[other][k] / rows[step][k]
            rows[other] = [a - factor * b for a, b in zip(rows[other], rows[step])]
            rows[other][k] = mpf(0)
            right[other] -= factor * right[step]
        pivots.append(k)
    rank = len(pivots)
    # At equal length, so that the elimination after this one sees weak rows as well.
    lengths = [sqrt(dot(row, row)) for row in rows[:rank]]
    return [scale(1 / l, row) for l, row in zip(lengths, rows)], [b / l for l, b in zip(lengths, right)]


def solve(matrix, right):
    rows = mp.matrix(matrix)
    return list(mp.lu_solve(rows, mp.matrix(right)))


def least(rows, right):
    """The shortest x with rows x = right."""
    rows, right = independent(rows, right)
    if not rows:
        return None
    gram = [[dot(a, b) for b in rows] for a in rows]
    share = solve(gram, right)
    return [dot(share, column) for column in zip(*rows)]


def close(model, q):
    zeros = [mpf(0)] * len(q)
    for _ in range(60):
        residual, jacobian, _ = model.closure(model.move(q, zeros), q, zeros)
        if not residual or max(abs(r) for r in residual) < mpf(10) ** -48:
            return q
        q = sub(q, least(jacobian, residual))
    raise SystemExit(f"{model.name}: cannot be closed")


def acceleration(model, q, u):
    state = model.move(q, u)
    mass, force = model.dynamics(state, q, u)
    _, jacobian, gamma = model.closure(state, q, u)
    rows, wanted = independent(jacobian, [-g for g in gamma]) if jacobian else ([], [])
    n, c = len(q), len(rows)
    matrix = [mass[i] + [row[i] for row in rows] for i in range(n)]
    matrix += [row + [mpf(0)] * c for row in rows]
    return solve(matrix, force + wanted)[:n], c


def states(model):
    chance = random.Random(1)
    guess = [joint["guess"] for joint in model.joints]
    n = len(guess)
    for distance in DISTANCES:
        largest = max(abs(g) for g in guess)
        q = close(model, scale(mpf(distance) / largest, guess))
        q = [mpf(float(x)) for x in q]
        q = close(model, q)
        u = [mpf(str(round(chance.uniform(-1, 1), 3))) for _ in range(n)]
        _, jacobian, _ = model.closure(model.move(q, u), q, u)
        if jacobian:
            u = sub(u, least(jacobian, [dot(row, u) for row in jacobian]))
        for speeds in [[mpf(0)] * n, u]:
            du, rank = acceleration(model, q, speeds)
            yield {
                "distance": float(distance),
                "q": [float(x) for x in q],
                "u": [float(x) for x in speeds],
                "acceleration": [float(x) for x in du],
                "rank": rank,
            }


def main():
    output, *paths = sys.argv[1:]
    models = []
    for path in paths:
        model = Model(path)
        name = os.path.relpath(path, WORKSPACE).replace(os.sep, "/")
        models.append({"model": name, "states": list(states(model))})
        print(path, [state["rank"] for state in models[-1]["states"]])
    with open(output, "w") as file:
        json.dump(models, file, indent=1)
        file.write("\n")


main()
