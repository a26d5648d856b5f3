"""Free bodies and contact against other programs: Pinocchio's free-flyer, and Drake's point contact."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from numpy.random import Generator, default_rng
from numpy.typing import NDArray

import lamc

Array = NDArray[np.float64]


def description(random: Generator, loop: int) -> dict[str, Any]:
    """A random mechanism that hangs on a free body: a tree, or with a ring of so many bodies whose hinge lines meet."""
    hinges: list[tuple[int, int]] = [(k, (k + 1) % loop) for k in range(loop)]
    bodies = max(loop, 1)
    for _ in range(int(random.integers(0 if loop else 1, 6))):
        hinges.append((int(random.integers(bodies)), bodies))
        bodies += 1
    # The creases around a vertex are so spread that the ring can fold.
    spread = (np.arange(loop) + random.uniform(-0.3, 0.3, loop)) * 2 * np.pi / max(loop, 1)
    directions = [*spread, *random.uniform(0, np.pi, len(hinges) - loop)]
    model: dict[str, Any] = {"name": "random", "bodies": {}, "joints": {}}
    for k in range(bodies):
        spread = random.normal(size=(3, 3))
        model["bodies"][f"b{k}"] = {
            "mass": float(random.uniform(0.5, 2)),
            "com": random.normal(size=3).tolist(),
            # Of points that are spread at random.
            "inertia": (np.trace(spread @ spread.T) * np.eye(3) - spread @ spread.T).tolist(),
        }
    model["bodies"]["b0"]["free"] = True
    for k, (pair, direction) in enumerate(zip(hinges, directions)):
        along = np.array([np.cos(direction), np.sin(direction)])
        across = np.array([-along[1], along[0]])
        start = np.zeros(2) if k < loop else float(random.normal()) * across
        order = pair if random.random() < 0.5 else pair[::-1]
        model["joints"][f"j{k}"] = {
            "bodies": [f"b{body}" for body in order],
            "axis": [start.tolist(), (start + along).tolist()],
            "stiffness": float(random.uniform(0, 3)),
            "damping": float(random.uniform(0, 1)),
            "rest": float(random.normal()),
        }
    return model


class Pinocchio:
    """A model of :func:`description` in Pinocchio: a tree on a free-flyer. A hinge that closes a ring carries a copy of its
    next body, without mass, that three points tie to the original."""

    def __init__(self, model: dict[str, Any]) -> None:
        self.source = model
        self.model = pin.Model()
        self.model.gravity.linear = np.array([0.0, 0.0, -9.81])
        bodies = model["bodies"]
        self.centre = np.array(bodies["b0"]["com"])
        root = self.model.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3(np.eye(3), self.centre), "b0")
        # For each body its joint, and where that joint's frame is drawn.
        self.places = {"b0": (root, self.centre)}
        self._add(root, self.centre, "b0")
        self.hinges: dict[str, tuple[int, float]] = {}
        self.rings: list[tuple[int, Array, str]] = []
        self._grow("b0")
        self.data = self.model.createData()

    def _grow(self, parent: str) -> None:
        """Adds the hinges of a body and what hangs on them: Pinocchio wants branches one after the other."""
        for name, hinge in self.source["joints"].items():
            if name in self.hinges or parent not in hinge["bodies"]:
                continue
            first, second = hinge["bodies"]
            child, sense = (second, 1.0) if parent == first else (first, -1.0)
            line = np.array([[*point, 0.0] for point in hinge["axis"]])
            above, origin = self.places[parent]
            axis = pin.JointModelRevoluteUnaligned(line[1] - line[0])
            joint = self.model.addJoint(above, axis, pin.SE3(np.eye(3), line[0] - origin), name)
            self.hinges[name] = joint, sense
            if child in self.places:
                self.rings.append((joint, line[0], child))
            else:
                self.places[child] = joint, line[0]
                self._add(joint, line[0], child)
                self._grow(child)

    def _add(self, joint: int, origin: Array, name: str) -> None:
        body = self.source["bodies"][name]
        inertia = pin.Inertia(body["mass"], np.array(body["com"]) - origin, np.array(body["inertia"]))
        self.model.appendBodyToJoint(joint, inertia, pin.SE3.Identity())

    def solve(self, q: Array, u: Array) -> tuple[Array, Array, float]:
        """lamc's du/dt; the centre of mass and the momenta (3, 3); the largest opening of the rings, m."""
        n = len(self.hinges)
        place, velocity, force = pin.neutral(self.model), np.zeros(self.model.nv), np.zeros(self.model.nv)
        w, x, y, z = q[n + 3 :]
        place[:7] = [*q[n : n + 3], x, y, z, w]
        turn = pin.Quaternion(w, x, y, z).toRotationMatrix()
        velocity[:3], velocity[3:6] = turn.T @ u[n : n + 3], u[n + 3 :]
        for k, (name, (joint, sense)) in enumerate(self._ordered()):
            hinge = self.source["joints"][name]
            at = self.model.joints[joint]
            place[at.idx_q], velocity[at.idx_v] = sense * q[k], sense * u[k]
            torque = -hinge["stiffness"] * (q[k] - hinge["rest"]) - hinge["damping"] * u[k]
            force[at.idx_v] = sense * torque
        data, model = self.data, self.model
        mass = pin.crba(model, data, place)
        mass = np.triu(mass) + np.triu(mass, 1).T
        bias = pin.nonLinearEffects(model, data, place, velocity)
        pin.computeJointJacobians(model, data, place)
        pin.forwardKinematics(model, data, place, velocity, np.zeros(model.nv))
        rows, drift, opening = np.zeros((0, model.nv)), np.zeros(0), 0.0
        for joint, origin, original in self.rings:
            other, drawn = self.places[original]
            for point in np.array([[0.3, 0.1, 0.2], [-0.4, 0.5, 0.1], [0.2, -0.6, -0.3]]):
                first, second = self._point(joint, point), self._point(other, point + origin - drawn)
                opening = max(opening, np.abs(first[0] - second[0]).max())
                rows = np.vstack([rows, first[1] - second[1]])
                drift = np.append(drift, first[2] - second[2])
        m = len(rows)
        matrix = np.block([[mass, -rows.T], [rows, np.zeros((m, m))]])
        solution = np.linalg.lstsq(matrix, np.append(force - bias, -drift), rcond=1e-11)[0]
        rates = solution[: model.nv]
        joints = [sense * rates[model.joints[joint].idx_v] for _, (joint, sense) in self._ordered()]
        linear = turn @ (rates[:3] + np.cross(velocity[3:6], velocity[:3]))
        total = pin.computeCentroidalMomentum(model, data, place, velocity)
        centre = pin.centerOfMass(model, data, place, velocity)
        momenta = np.array([centre, total.linear, total.angular])
        return np.array([*joints, *linear, *rates[3:6]]), momenta, opening

    def _ordered(self) -> list[tuple[str, tuple[int, float]]]:
        """The hinges in the order of lamc's q."""
        return [(name, self.hinges[name]) for name in self.source["joints"]]

    def _point(self, joint: int, arm: Array) -> tuple[Array, Array, Array]:
        """The place of a point of a joint's frame, its Jacobian, and its acceleration at rates of zero."""
        aligned = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        frame = self.data.oMi[joint]
        out = frame.rotation @ arm
        jacobian = pin.getJointJacobian(self.model, self.data, joint, aligned)
        omega = pin.getVelocity(self.model, self.data, joint, aligned).angular
        turning = pin.getAcceleration(self.model, self.data, joint, aligned).angular
        moving = pin.getClassicalAcceleration(self.model, self.data, joint, aligned).linear
        acceleration = moving + np.cross(turning, out) + np.cross(omega, np.cross(omega, out))
        return frame.translation + out, jacobian[:3] - pin.skew(out) @ jacobian[3:], acceleration


@pytest.mark.parametrize("loop", [0, 4, 5, 6, 7])
def test_accelerations_are_those_of_pinocchio(loop: int) -> None:
    random = default_rng(100 + loop)
    for _ in range(10):
        source = description(random, loop)
        model, peer = lamc.load(source), Pinocchio(source)
        n = len(model.joints)
        guess = np.append(random.uniform(-1, 1, n), random.normal(size=7))
        guess[n + 3 :] /= np.linalg.norm(guess[n + 3 :])
        q, u = model.assemble(guess, random.normal(size=n + 6))
        rates, momenta, opening = peer.solve(q, u)
        assert opening < 1e-11
        found = model.acceleration(q, u)
        assert np.abs(found - rates).max() <= 1e-9 * np.abs(rates).max(), source
        ours = model.momentum(q, u)
        assert np.abs(ours - momenta).max() <= 1e-10 * np.abs(momenta).max()


SIDES = np.array([0.04, 0.03, 0.02])
MASS = 500.0 * SIDES.prod()
DISSIPATION, SLIP = 1.0, 1e-3


def box(stiffness: float, friction: float, height: float, turn: Array, velocity: Array, omega: Array) -> lamc.Model:
    """A box whose centre is so high above the ground, m; `turn` is a rotation vector, rad."""
    x, y, z = SIDES
    return lamc.load(
        {
            "name": "parcel",
            "materials": {"foam": {"density": MASS / SIDES.prod(), "thickness": z}},
            "layup": ["foam"],
            "bodies": {"parcel": {"free": True, "outline": [[0, 0], [x, 0], [x, y], [0, y]]}},
            "contacts": {
                "ground": {
                    "plane": {"point": [0, 0, 0], "normal": [0, 0, 1]},
                    "stiffness": stiffness,
                    "dissipation": DISSIPATION,
                    "friction": friction,
                    "slip_speed": SLIP,
                }
            },
            "initial": {
                "bodies": {
                    "parcel": {
                        # From where it is drawn: with a corner at the origin.
                        "position": [-x / 2, -y / 2, height - z / 2],
                        "turn": turn.tolist(),
                        "velocity": velocity.tolist(),
                        "angular_velocity": omega.tolist(),
                    }
                }
            },
        }
    )


def drake(stiffness: float, mu: float, q: Array, u: Array, times: Array) -> Array:
    """lamc's q (S, 7) of the same box in Drake.

    Its corners are spheres of a nanometre on ground that is a billion times stiffer. The law of the normal force is the same. Drake's
    friction goes from rest to sliding on another curve, and acts half the depth above the corner: its lever differs by as much.
    """
    import pydrake.all as d

    builder = d.DiagramBuilder()
    plant, _ = d.AddMultibodyPlantSceneGraph(builder, time_step=0.0)
    plant.set_stiction_tolerance(SLIP)
    friction = d.CoulombFriction(mu, mu)

    def material(stiffness: float, dissipation: float) -> Any:
        properties = d.ProximityProperties()
        d.AddContactMaterial(dissipation, stiffness, friction, properties)
        return properties

    inertia = d.SpatialInertia.SolidBoxWithMass(MASS, *SIDES)
    body = plant.AddRigidBody("box", inertia)
    corners = material(stiffness, DISSIPATION)
    for k in range(8):
        corner = SIDES / 2 * [1 - 2 * (k >> i & 1) for i in range(3)]
        at = d.RigidTransform(corner)
        plant.RegisterCollisionGeometry(body, at, d.Sphere(1e-9), f"corner{k}", corners)
    stiff = material(1e9 * stiffness, 0.0)
    world = plant.world_body()
    plant.RegisterCollisionGeometry(world, d.RigidTransform(), d.HalfSpace(), "ground", stiff)
    plant.Finalize()
    simulator = d.Simulator(builder.Build())
    integrator = d.ResetIntegratorFromFlags(simulator, "runge_kutta3", 2e-5)
    integrator.set_fixed_step_mode(False)
    integrator.set_target_accuracy(1e-9)
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    start = q[:3] + SIDES / 2
    turn = d.Quaternion(q[3:])
    plant.SetFreeBodyPose(context, body, d.RigidTransform(turn, start))
    spin = d.RotationMatrix(turn).multiply(u[3:])
    plant.SetFreeBodySpatialVelocity(context, body, d.SpatialVelocity(spin, u[:3]))
    rows = []
    for t in times:
        simulator.AdvanceTo(t)
        pose = plant.EvalBodyPoseInWorld(context, body)
        quaternion = pose.rotation().ToQuaternion().wxyz()
        rows.append([*(pose.translation() - SIDES / 2), *quaternion])
    return np.array(rows)


def tumble(stiffness: float, friction: float, height: float, speeds: list[float], seconds: float) -> float:
    """The largest distance of lamc's motion from Drake's: of the centre over the box, or of the quaternion."""
    turn = np.array([0.5, 0.3, 0.2]) if height > SIDES[2] else np.array([0, 0, 0.3])
    velocity, omega = np.array(speeds[:3]), np.array(speeds[3:])
    motion = box(stiffness, friction, height, turn, velocity, omega).simulate(seconds, 100, tolerance=1e-10)
    peer = drake(stiffness, friction, motion.q[0], motion.u[0], motion.t)
    # The ground has pushed.
    assert motion.u[-1, 2] > velocity[2] - 9.81 * seconds + 0.1
    same = np.sign((motion.q[:, 3:] * peer[:, 3:]).sum(axis=1))
    turned = motion.q[:, 3:] - same[:, None] * peer[:, 3:]
    return float(max(np.abs(motion.q[:, :3] - peer[:, :3]).max() / SIDES.max(), np.abs(turned).max()))


def test_a_box_slides_and_stops_as_in_drake() -> None:
    assert tumble(400.0, 0.4, 0.00996, [0.6, 0.2, 0, 0, 0, 0], 0.4) <= 1e-4


def test_a_box_falls_as_in_drake() -> None:
    thrown = [0.5, 0.1, -0.3, 3, -5, 2]
    # Three impacts.
    assert tumble(400.0, 0.0, 0.03, thrown, 0.12) <= 1e-6
    # Two of them, with friction: a hundred times stiffer, a corner sinks in by a tenth, and so far Drake's lever differs.
    soft, stiff = (tumble(stiffness, 0.4, 0.03, thrown, 0.05) for stiffness in (4e3, 4e5))
    assert stiff <= 1e-3 and 5 <= soft / stiff <= 20, (soft, stiff)
