"""The model as MuJoCo's XML: hinges with springs and dampers, free bodies, loops as welds, and contact points as
spheres against a plane. Nothing else collides."""

import math
from xml.etree import ElementTree as xml


def text(numbers):
    return " ".join(repr(float(x)) for x in numbers)


# Length of a step of the robots on the ground, s; as in contacts.rs.
STEP = 1e-5
# Radius of a contact point, m: the depth of a sphere is larger than that of its centre by its radius.
RADIUS = 1e-9


def write(model, path, boxes=None, touches=True):
    """Returns the joints in MuJoCo's order (depth first). `boxes` are the half sizes and centres of boxes on nodes that
    touch the plane in place of the contact points; nothing touches if `touches` is False."""
    root = xml.Element("mujoco", model=model.name)
    xml.SubElement(root, "compiler", angle="radian", autolimits="false")
    option = xml.SubElement(root, "option", gravity=text(model.gravity), solver="Newton")
    off = ["limit", "frictionloss", "actuation", "sensor", "island"]
    if model.contact is None or not touches:
        off.append("contact")
    if model.contact is not None:
        option.set("integrator", "RK4")
        option.set("timestep", repr(STEP))
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
        bodies[i] = body
        j = node.joint
        if j is None:
            xml.SubElement(body, "freejoint")
            continue
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
    if model.contact is not None:
        touching(model, bodies, boxes)
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


def touching(model, bodies, boxes):
    """The plane, and the spheres or boxes that it touches; these touch nothing else."""
    contact = model.contact
    law = {"condim": "3", "friction": text([contact["friction"], 0, 0])}
    upwards = contact["normal"]
    plane = {"type": "plane", "size": "1 1 1", "pos": text(contact["point"]), "zaxis": text(upwards)}
    xml.SubElement(bodies[None], "geom", **plane, **law, contype="1", conaffinity="0")
    law |= {"contype": "0", "conaffinity": "1"}
    if boxes:
        for node, half, centre in boxes:
            shape = {"type": "box", "size": text(half), "pos": text(centre)}
            xml.SubElement(bodies[node], "geom", **shape, **law)
        return
    for k, point in enumerate(contact["points"]):
        node = model.nodes[point["node"]]
        centre = node.axes.T @ (point["at"] - node.origin)
        shape = {"name": f"p{k}", "type": "sphere", "size": repr(RADIUS), "pos": text(centre)}
        xml.SubElement(bodies[point["node"]], "geom", **shape, **law)
