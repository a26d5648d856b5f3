"""The numeric model that `peers export` writes, in frames of the tree's nodes.

Hinge-aligned: x along the hinge, so that a node turns about its own x by sense * q, z along the base
frame's z in the flat state; origins slid along the hinge line to where it meets its parent's.
Flat: axes parallel to the base frame's in the flat state, origins at the drawn hinge points.
"""

import json
from dataclasses import dataclass

import numpy as np

# Relative to the size, or to 1: smaller numbers are rounding errors of the drawing.
ROUNDING = 1e-13


@dataclass
class Node:
    """A body, or a ghost of one, that hangs on a joint. SI; vectors in the node's own frame."""

    joint: int
    parent: int | None
    sense: float
    turn: np.ndarray  # axes of this frame in the parent's, flat state
    offset: np.ndarray  # origin of this frame in the parent's
    axis: np.ndarray
    mass: float
    com: np.ndarray
    inertia: np.ndarray  # about the centre of mass
    axes: np.ndarray  # columns: the axes in flat coordinates
    origin: np.ndarray  # flat coordinates


class Model:
    """Nodes, joints, loops, contact points, states, gravity."""

    def __init__(self, path, aligned=True):
        with open(path) as file:
            data = json.load(file)
        self.name = data["name"]
        self.gravity = np.array(data["gravity"])
        self.loops = data["loops"]
        joints = data["joints"]
        self.stiffness, self.damping, self.rest = (
            np.array([joint[key] for joint in joints]) for key in ("stiffness", "damping", "rest")
        )
        self.contact = data.get("contact")
        states = lambda key: np.array([state[key] for state in data["states"] if key in state])
        self.q, self.u, self.acceleration = map(states, ("q", "u", "acceleration"))
        # Of mechanisms that touch nothing; of robots on the ground position and force of each point.
        self.acceleration_at_rest, self.contacts = map(states, ("acceleration_at_rest", "contacts"))
        self.n = len(joints)
        self.nodes = []
        for raw in data["nodes"]:
            if raw["joint"] is None:
                # A free body: its position is that of its centre of mass.
                point, direction = np.array(raw["com"]), np.zeros(3)
            else:
                joint = joints[raw["joint"]]
                point, direction = np.array(joint["point"]), np.array(joint["direction"])
            x = direction * raw["sense"]
            z = np.array([0.0, 0.0, 1.0])
            axes = np.column_stack([x, np.cross(z, x), z]) if aligned else np.eye(3)
            origin = self._origin(data, raw, point, direction) if aligned else point
            parent = None if raw["parent"] is None else self.nodes[raw["parent"]]
            base = (np.eye(3), np.zeros(3)) if parent is None else (parent.axes, parent.origin)
            self.nodes.append(
                Node(
                    joint=raw["joint"],
                    parent=raw["parent"],
                    sense=raw["sense"],
                    turn=clean(base[0].T @ axes, 1.0),
                    offset=clean(base[0].T @ (origin - base[1]), data["size"]),
                    axis=clean(axes.T @ x, 1.0),
                    mass=raw["mass"],
                    com=clean(axes.T @ (np.array(raw["com"]) - origin), data["size"]),
                    inertia=clean(axes.T @ np.array(raw["inertia"]) @ axes),
                    axes=axes,
                    origin=origin,
                )
            )

    def _origin(self, data, raw, point, direction):
        """The centre of a spherical loop of the hinge, or the point of its line nearest to that of its parent (or a
        child)."""
        for loop in data["loops"]:
            if loop["centre"] is not None and raw["joint"] in loop["joints"]:
                return np.array(loop["centre"])
        if raw["parent"] is None:
            index = data["nodes"].index(raw)
            others = [node for node in data["nodes"] if node["parent"] == index]
        else:
            others = [data["nodes"][raw["parent"]]]
        for other in others[:1]:
            other = data["joints"][other["joint"]]
            normal = np.cross(direction, other["direction"])
            if normal @ normal > ROUNDING:
                away = np.cross(np.array(other["point"]) - point, other["direction"])
                return point + direction * (away @ normal) / (normal @ normal)
        return point

    def between(self, original, ghost):
        """From the ghost's frame into the original's, where the loop is closed."""
        return clean(self.nodes[original].axes.T @ self.nodes[ghost].axes, 1.0)

    def offset(self, original, ghost):
        """The ghost's origin in the original's frame, where the loop is closed."""
        a, b = self.nodes[original], self.nodes[ghost]
        return a.axes.T @ (b.origin - a.origin)

    def depth_first(self, parent=None):
        """Nodes in an order that keeps every branch together."""
        children = [i for i, node in enumerate(self.nodes) if node.parent == parent]
        return [i for child in children for i in (child, *self.depth_first(child))]

    def about_origin(self, node):
        """Mass, first moment and inertia about the frame's origin."""
        c = node.com
        inertia = node.inertia + node.mass * (c @ c * np.eye(3) - np.outer(c, c))
        return node.mass, node.mass * c, clean(inertia)


def clean(x, scale=None):
    """Replaces numbers that are rounding errors by zero."""
    scale = np.abs(x).max() if scale is None else scale
    return np.where(np.abs(x) <= ROUNDING * scale, 0.0, x)
