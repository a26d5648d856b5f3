"""The model as MuJoCo's XML: hinges with springs and dampers, loops as welds, no collisions."""

import math
from xml.etree import ElementTree as xml


def text(numbers):
    return " ".join(repr(float(x)) for x in numbers)


def write(model, path):
    """Returns the joints in MuJoCo's order (depth first)."""
    root = xml.Element("mujoco", model=model.name)
    xml.SubElement(root, "compiler", angle="radian", autolimits="false")
    option = xml.SubElement(root, "option", gravity=text(model.gravity), solver="Newton")
    off = ("contact", "limit", "frictionloss", "actuation", "sensor", "island")
    xml.SubElement(option, "flag", dict.fromkeys(off, "disable"))
    bodies = {None: xml.SubElement(root, "worldbody")}
    for i, node in enumerate(model.nodes):
        half = math.atan2(node.turn[1, 0], node.turn[0, 0]) / 2
        body = xml.SubElement(
            bodies[node.parent],
            "body",
            name=f"n{i}",
            pos=text(node.offset),
            quat=text([math.cos(half), 0, 0, math.sin(half)]),
        )
        t = node.inertia
        xml.SubElement(
            body,
            "inertial",
            mass=repr(node.mass),
            pos=text(node.com),
            fullinertia=text([t[0, 0], t[1, 1], t[2, 2], t[0, 1], t[0, 2], t[1, 2]]),
        )
        j = node.joint
        xml.SubElement(
            body,
            "joint",
            name=f"j{j}",
            type="hinge",
            axis=text(node.axis),
            stiffness=repr(float(model.stiffness[j])),
            damping=repr(float(model.damping[j])),
            springref=repr(float(model.rest[j])),
        )
        bodies[i] = body
    if model.loops:
        equality = xml.SubElement(root, "equality")
        for loop in model.loops:
            # The stiffest constraints of MuJoCo; lengths are of the order of 0.1 m, and rotations
            # count more than translations.
            xml.SubElement(
                equality,
                "weld",
                body1=f"n{loop['original']}",
                body2=f"n{loop['ghost']}",
                torquescale="1000",
                solimp="0.9999 0.9999 0.001 0.5 2",
            )
    xml.ElementTree(root).write(path)
    return [int(joint.get("name")[1:]) for joint in root.iter("joint")]
