"""CasADi as an expert uses it: recursions in body frames, scalar expressions, common
subexpressions once, factors unrolled; C by CasADi's code generator.

Featherstone, Rigid Body Dynamics Algorithms (2008): recursive Newton-Euler (table 5.1), composite
rigid bodies (table 6.2), L^T D L without fill (tables 6.3, 6.5), articulated bodies (table 7.1).
"""

import casadi as ca
import numpy as np

X, Y, Z = range(3)


class Matrix:
    """A rotation as a matrix of expressions: from a node's frame into its parent's."""

    def __init__(self, node, q):
        along = ca.SX(np.outer(node.axis, node.axis))
        across = ca.SX.eye(3) - along
        self.r = ca.SX(node.turn) @ (
            along + ca.cos(q) * across + ca.sin(q) * ca.skew(ca.SX(node.axis))
        )

    def up(self, x):
        return self.r @ x

    def down(self, x):
        return self.r.T @ x

    def symmetric_up(self, x):
        return symmetric(self.r @ x @ self.r.T)


class Aligned:
    """A rotation about x by q, then a constant rotation about z, applied separately."""

    def __init__(self, node, q):
        self.c, self.s = ca.cos(q), ca.sin(q)
        self.cz, self.sz = float(node.turn[0, 0]), float(node.turn[1, 0])

    def up(self, x):
        y, z = self.c * x[Y] - self.s * x[Z], self.s * x[Y] + self.c * x[Z]
        return ca.vertcat(self.cz * x[X] - self.sz * y, self.sz * x[X] + self.cz * y, z)

    def down(self, x):
        y = self.cz * x[Y] - self.sz * x[X]
        return ca.vertcat(
            self.cz * x[X] + self.sz * x[Y], self.c * y + self.s * x[Z], self.c * x[Z] - self.s * y
        )

    def symmetric_up(self, x):
        return spin(spin(x, (Y, Z), self.c, self.s), (X, Y), self.cz, self.sz)


def spin(x, plane, c, s):
    """A symmetric matrix rotated in a plane of two axes."""
    i, j = plane
    k = 3 - i - j
    w = 2 * c * x[i, j] + s * (x[i, i] - x[j, j])
    out = ca.SX.zeros(3, 3)
    out[k, k] = x[k, k]
    out[i, i], out[j, j] = x[i, i] - s * w, x[j, j] + s * w
    out[i, j] = c * w - x[i, j]
    out[i, k], out[j, k] = c * x[i, k] - s * x[j, k], s * x[i, k] + c * x[j, k]
    return symmetric(out, upper=sorted([(i, j), (i, k), (j, k)]))


def symmetric(x, upper=((X, Y), (X, Z), (Y, Z))):
    """Both triangles from one."""
    for i, j in upper:
        x[j, i] = x[i, j]
    return x


def turning(omega, alpha):
    """[alpha]x + [omega]x [omega]x: multiplied by a lever it gives the acceleration of its end."""
    xx, yy, zz = (omega[k] * omega[k] for k in range(3))
    xy, xz, yz = omega[X] * omega[Y], omega[X] * omega[Z], omega[Y] * omega[Z]
    x, y, z = (alpha[k] for k in range(3))
    rows = [[-yy - zz, xy - z, xz + y], [xy + z, -xx - zz, yz - x], [xz - y, yz + x, -xx - yy]]
    return ca.vertcat(*(ca.horzcat(*row) for row in rows))


def shifted(mass, h, inertia, r):
    """First moment and inertia about a point r before the origin."""
    rh = 2 * ca.dot(r, h) + mass * ca.dot(r, r)
    cross = r @ h.T
    shift = rh * ca.SX.eye(3) - cross - cross.T - mass * (r @ r.T)
    return h + mass * r, inertia + shift


class Mechanics:
    """Expressions of a model: everything is indexed by the tree's nodes, parents first."""

    def __init__(self, model, aligned):
        self.model, self.nodes = model, model.nodes
        self.q, self.u = ca.SX.sym("q", model.n), ca.SX.sym("u", model.n)
        turn = Aligned if aligned else Matrix
        self.turns = [turn(node, self.q[node.joint]) for node in self.nodes]
        self.axes = [ca.SX(node.axis) for node in self.nodes]
        self.offsets = [ca.SX(node.offset) for node in self.nodes]
        self.bodies = [tuple(map(ca.SX, model.about_origin(node))) for node in self.nodes]

    def torque(self, node):
        m, j = self.model, node.joint
        return m.stiffness[j] * (m.rest[j] - self.q[j]) - m.damping[j] * self.u[j]

    def ancestors(self, i):
        while (i := self.nodes[i].parent) is not None:
            yield i

    def velocities(self):
        """omega of the nodes, and alpha for du/dt = 0, in the nodes' frames."""
        omegas, alphas = [], []
        for node, turn, axis in zip(self.nodes, self.turns, self.axes):
            spin = axis * self.u[node.joint]
            if node.parent is None:
                omegas.append(spin)
                alphas.append(ca.SX.zeros(3))
            else:
                omega = turn.down(omegas[node.parent])
                alphas.append(turn.down(alphas[node.parent]) + ca.cross(omega, spin))
                omegas.append(omega + spin)
        return omegas, alphas

    def forcing(self, omegas, alphas):
        """Torques minus those of du/dt = 0: recursive Newton-Euler."""
        turning_of = [turning(omega, alpha) for omega, alpha in zip(omegas, alphas)]
        wrenches, accelerations = [], []
        for i, (node, turn) in enumerate(zip(self.nodes, self.turns)):
            if node.parent is None:
                a = ca.SX(-self.model.gravity)
            else:
                a = accelerations[node.parent] + turning_of[node.parent] @ self.offsets[i]
            a = turn.down(a)
            accelerations.append(a)
            mass, h, inertia = self.bodies[i]
            force = mass * a + turning_of[i] @ h
            spin = ca.cross(omegas[i], inertia @ omegas[i])
            wrenches.append((force, inertia @ alphas[i] + spin + ca.cross(h, a)))
        forcing = [None] * len(self.nodes)
        for i in reversed(range(len(self.nodes))):
            node, (force, moment) = self.nodes[i], wrenches[i]
            forcing[i] = self.torque(node) - ca.dot(self.axes[i], moment)
            if node.parent is not None:
                force, moment = self.turns[i].up(force), self.turns[i].up(moment)
                f, m = wrenches[node.parent]
                moment += ca.cross(self.offsets[i], force)
                wrenches[node.parent] = (f + force, m + moment)
        return forcing

    def mass_matrix(self):
        """Lower triangle, {(i, j): i a descendant of j or j}: composite rigid bodies."""
        composites = list(self.bodies)
        matrix = {}
        for i in reversed(range(len(self.nodes))):
            mass, h, inertia = composites[i]
            force, moment = ca.cross(self.axes[i], h), inertia @ self.axes[i]
            matrix[i, i] = ca.dot(self.axes[i], moment)
            below = i
            for j in self.ancestors(i):
                force, moment = self.turns[below].up(force), self.turns[below].up(moment)
                moment += ca.cross(self.offsets[below], force)
                matrix[i, j] = ca.dot(self.axes[j], moment)
                below = j
            parent = self.nodes[i].parent
            if parent is not None:
                turn = self.turns[i]
                h, inertia = turn.up(h), turn.symmetric_up(inertia)
                h, inertia = shifted(mass, h, inertia, self.offsets[i])
                m, first, second = composites[parent]
                composites[parent] = (m + mass, first + h, second + inertia)
        return matrix

    def factored(self, matrix):
        """M = L^T D L, from the leaves: L has M's zeros. L below the diagonal, 1/D on it."""
        for k in reversed(range(len(self.nodes))):
            matrix[k, k] = 1 / matrix[k, k]
            above = list(self.ancestors(k))
            for at, i in enumerate(above):
                factor = matrix[k, i] * matrix[k, k]
                for j in [i, *above[at + 1 :]]:
                    matrix[i, j] -= factor * matrix[k, j]
                matrix[k, i] = factor
        return matrix

    def forward(self, factor, x):
        """L^-T x."""
        x = list(x)
        for i in reversed(range(len(x))):
            for j in self.ancestors(i):
                x[j] -= factor[i, j] * x[i]
        return x

    def backward(self, factor, x):
        """L^-1 x."""
        x = list(x)
        for i in range(len(x)):
            for j in self.ancestors(i):
                x[i] -= factor[i, j] * x[j]
        return x

    def factored_acceleration(self, closure=None):
        """du/dt by the factored M; with loops, through J M^-1 J^T."""
        omegas, alphas = self.velocities()
        factor = self.factored(self.mass_matrix())
        count = range(len(self.nodes))
        x = self.forward(factor, self.forcing(omegas, alphas))
        if closure is not None:
            jacobian, gamma = closure(alphas)
            rows = [self.forward(factor, row) for row in jacobian]
            scaled = [[row[i] * factor[i, i] for i in count] for row in rows]
            dot = lambda a, b: sum((s * t for s, t in zip(a, b)), ca.SX(0))
            delassus = {
                (i, j): dot(scaled[i], rows[j]) for i in range(len(rows)) for j in range(i + 1)
            }
            right = [-g - dot(row, x) for row, g in zip(scaled, gamma)]
            for i, multiplier in enumerate(solved(delassus, right)):
                x = [a + multiplier * row for a, row in zip(x, rows[i])]
        x = self.backward(factor, [x[i] * factor[i, i] for i in count])
        return self.by_joint(x)

    def by_joint(self, x):
        out = [None] * len(x)
        for node, value in zip(self.nodes, x):
            out[node.joint] = value
        return ca.vertcat(*out)

    def closure_by_differentiation(self, _alphas):
        """Rows of the closed loops, differentiated by CasADi: the difference of R_ghost^T R_original from the
        unit matrix, for hinge lines that meet in a point."""
        rows = []
        for loop in self.model.loops:
            assert loop["class"] == "spherical", loop["class"]
            original, ghost = loop["original"], loop["ghost"]
            here = self.axes_in_base(original, self.model.between(original, ghost))
            there = self.axes_in_base(ghost, np.eye(3))
            pairs = ((Z, Y), (X, Z), (Y, X))
            rows += [ca.dot(there[i], here[j]) for i, j in pairs]
        rows = ca.vertcat(*rows)
        rates = ca.jtimes(rows, self.q, self.u)
        jacobian = ca.jacobian(rows, self.q)
        gamma = ca.jtimes(rates, self.q, self.u)
        columns = [node.joint for node in self.nodes]
        return [[jacobian[i, j] for j in columns] for i in range(rows.numel())], gamma.elements()

    def axes_in_base(self, i, columns):
        """Vectors fixed to a node, carried down to the base frame."""
        x, y = (ca.SX(columns[:, k]) for k in (X, Y))
        for j in (i, *self.ancestors(i)):
            x, y = self.turns[j].up(x), self.turns[j].up(y)
        return x, y, ca.cross(x, y)

    def closure_by_recursion(self, alphas):
        """omega_original - omega_ghost and its rate, in the original's frame: sufficient if all
        hinge lines meet in a point."""
        jacobian, gamma = [], []
        for loop in self.model.loops:
            assert loop["class"] == "spherical", loop["class"]
            columns = [ca.SX.zeros(3)] * len(self.nodes)
            original, ghost = loop["original"], loop["ghost"]
            still = ca.SX(self.model.between(original, ghost))
            for end, sign, into in ((original, 1, ca.SX.eye(3)), (ghost, -1, still)):
                path = [end, *self.ancestors(end)]
                for at, k in enumerate(path):
                    x = self.axes[k]
                    for below in reversed(path[:at]):
                        x = self.turns[below].down(x)
                    columns[k] = columns[k] + sign * (into @ x)
            jacobian += [[column[row] for column in columns] for row in range(3)]
            gamma += (alphas[original] - still @ alphas[ghost]).elements()
        return jacobian, gamma

    def articulated_acceleration(self):
        """du/dt of a tree by articulated bodies: inertias [I H; H^T M] about the origins."""
        omegas, _ = self.velocities()
        zero = ca.SX.zeros(3)
        inertias, biases, drifts = [], [], []
        for i, (node, turn) in enumerate(zip(self.nodes, self.turns)):
            mass, h, inertia = self.bodies[i]
            spin = self.axes[i] * self.u[node.joint]
            if node.parent is None:
                drifts.append((ca.cross(omegas[i], spin), zero))
            else:
                lever = turning(omegas[node.parent], zero) @ self.offsets[i]
                drifts.append((ca.cross(omegas[i], spin), turn.down(lever)))
            centripetal = turning(omegas[i], zero)
            biases.append((ca.cross(omegas[i], inertia @ omegas[i]), centripetal @ h))
            inertias.append((inertia, ca.skew(h), mass * ca.SX.eye(3)))
        pivots, forces, columns = ([None] * len(self.nodes) for _ in range(3))
        for i in reversed(range(len(self.nodes))):
            node, turn, axis, r = self.nodes[i], self.turns[i], self.axes[i], self.offsets[i]
            (a, h, m), (moment, force) = inertias[i], biases[i]
            top, bottom = a @ axis, h.T @ axis
            pivots[i] = 1 / ca.dot(axis, top)
            forces[i] = self.torque(node) - ca.dot(axis, moment)
            columns[i] = (top, bottom)
            if node.parent is None:
                continue
            st, sb = top * pivots[i], bottom * pivots[i]
            a, h, m = symmetric(a - top @ st.T), h - top @ sb.T, symmetric(m - bottom @ sb.T)
            alpha, linear = drifts[i]
            moment = moment + a @ alpha + h @ linear + st * forces[i]
            force = force + h.T @ alpha + m @ linear + sb * forces[i]
            a, m = turn.symmetric_up(a), turn.symmetric_up(m)
            h = ca.horzcat(*(turn.up(h[:, k]) for k in range(3))).T
            h = ca.horzcat(*(turn.up(h[:, k]) for k in range(3))).T
            # [1 rx; 0 1] [A H; H^T M] [1 0; -rx 1], with (a, f) at the parent's origin.
            rx = ca.skew(r)
            hm = h + rx @ m
            a = symmetric(a + rx @ h.T - hm @ rx)
            moment, force = turn.up(moment), turn.up(force)
            moment = moment + ca.cross(r, force)
            p = node.parent
            inertias[p] = tuple(old + new for old, new in zip(inertias[p], (a, hm, m)))
            biases[p] = tuple(old + new for old, new in zip(biases[p], (moment, force)))
        rates, motions = [], []
        for i, (node, turn) in enumerate(zip(self.nodes, self.turns)):
            alpha, linear = drifts[i]
            if node.parent is None:
                linear = linear + turn.down(ca.SX(-self.model.gravity))
            else:
                above, a = motions[node.parent]
                alpha = alpha + turn.down(above)
                linear = linear + turn.down(a + ca.cross(above, self.offsets[i]))
            top, bottom = columns[i]
            carried = ca.dot(top, alpha) + ca.dot(bottom, linear)
            rates.append(pivots[i] * (forces[i] - carried))
            motions.append((alpha + self.axes[i] * rates[i], linear))
        return self.by_joint(rates)


def solved(matrix, right):
    """A small symmetric system by L D L^T; lower triangle."""
    n, x = len(right), list(right)
    for k in range(n):
        inverse = 1 / matrix[k, k]
        for i in range(k + 1, n):
            factor = matrix[i, k] * inverse
            for j in range(k + 1, i + 1):
                matrix[i, j] -= factor * matrix[j, k]
            x[i] -= factor * x[k]
        matrix[k, k] = inverse
    for k in reversed(range(n)):
        x[k] = x[k] * matrix[k, k]
        for i in range(k + 1, n):
            x[k] -= matrix[i, k] * matrix[k, k] * x[i]
    return x
