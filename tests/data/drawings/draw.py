"""Drawings in popupCAD's format, and what they weigh by closed forms.

    python3 tests/data/drawings/draw.py

writes drawn_NAME.cad.joints, as foldable_robotics writes its `DynamicsInfo`, and drawn_NAME.json: the mass,
centre and inertia (about the centre) of every body, the rank of the closure away from the flat state, and
every joint with its parent and child, as a walk from the ground finds them. A body is a sum of flat prisms. The integrals of 1, x, y, x^2, x y and y^2 over a polygon are added up from
triangles to its first corner, each by the three midpoints of its edges, which is exact to second order; lamc
integrates along the outline instead. Parents are written down here by hand, lamc finds them by a walk.
"""

import json
import math
import os
import textwrap

FOLDER = os.path.dirname(os.path.abspath(__file__))
TAG = "!!python/object:foldable_robotics.dynamics_info."
TUPLE = "!!python/tuple"

# name, density kg/m^3, thickness m. Two adhesives of one name and different densities are two materials.
FIVE = [("rigid", 1400, 0.0008), ("adhesive", 1050, 0.00005), ("flexible", 1420, 0.000125),
        ("adhesive", 1050, 0.00005), ("rigid", 1400, 0.0008)]
SEVEN = [("card", 800, 0.0003), ("adhesive", 1050, 0.00003), ("film", 1390, 0.00005), ("spacer", 120, 0.0001),
         ("film", 1390, 0.00005), ("adhesive", 980, 0.00003), ("card", 800, 0.0003)]


def box(x0, y0, x1, y1):
    return [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]


def ring(centre, inner, outer, first, last):
    """The plate between two rays, in degrees, and two radii."""
    at = lambda r, a: (centre[0] + r * math.cos(math.radians(a)), centre[1] + r * math.sin(math.radians(a)))
    return [at(inner, first), at(outer, first), at(outer, last), at(inner, last)]


def rigid_and_flexible(outline, *holes):
    """Five layers: holes are cut out of the rigid ones alone."""
    cut, whole = [(outline, list(holes))], [(outline, [])]
    return [cut, cut, whole, cut, cut]


def pendulum():
    base = rigid_and_flexible(box(-0.03, 0, 0.03, 0.04), box(-0.01, 0.01, 0.012, 0.03))
    # Clockwise, and a corner on an edge: both are allowed.
    arm = rigid_and_flexible([(-0.03, 0), (0, 0), (0.03, 0), (0.02, -0.08), (-0.02, -0.08)],
                             [(-0.01, -0.02), (0.01, -0.02), (0, -0.04)])
    hinge = dict(line=[(-0.03, 0), (0.03, 0)], z=0.0009125, bodies=(1, 0), parent=0, stiffness=0.003,
                 damping=2e-05, rest=0, limits=(-180, 150))
    return FIVE, [base, arm], [0], [hinge], 0


def fourbar():
    """One planar loop; plates side by side, so that the bars lie over one another only in x."""
    ground = [(-0.05, 0), (0, 0), (0, 0.02), (-0.025, 0.02), (-0.025, 0.075), (0.06, 0.075), (0.06, 0.055),
              (0.1, 0.055), (0.1, 0.09), (-0.05, 0.09)]
    rocker = [(-0.02, 0.03), (0.02, 0.03), (0.02, 0.05), (0, 0.05), (0, 0.055), (0.06, 0.055), (0.06, 0.07),
              (-0.02, 0.07)]
    coupler = [(0.05, 0), (0.075, 0), (0.075, 0.05), (0.02, 0.05), (0.02, 0.03), (0.05, 0.03)]
    bodies = [
        rigid_and_flexible(coupler, [(0.055, 0.004), (0.071, 0.004), (0.055, 0.02)], box(0.03, 0.035, 0.045, 0.045)),
        rigid_and_flexible(ground),
        rigid_and_flexible(box(0, 0, 0.05, 0.02), box(0.015, 0.005, 0.03, 0.015)),
        rigid_and_flexible(rocker),
    ]
    hinge = lambda x, y0, y1, bodies, parent, **others: dict(
        dict(line=[(x, y0), (x, y1)], z=0.0009125, bodies=bodies, parent=parent, stiffness=0.01, damping=5e-05,
             rest=0, limits=(-180, 180)), **others)
    joints = [
        hinge(0, 0, 0.02, (1, 2), 1, rest=20),
        hinge(0.05, 0, 0.02, (0, 2), 2, stiffness=0.008),
        hinge(0.02, 0.05, 0.03, (0, 3), 3, stiffness=0.012, damping=4e-05),
        hinge(0.06, 0.055, 0.07, (3, 1), 1, rest=-12.5, limits=(-170, 160)),
    ]
    return FIVE, bodies, [1], joints, 3


def sixbar():
    """One spherical loop: six creases through a point, at full precision."""
    centre, rays = (0.012, -0.007), [20, 75, 140, 200, 265, 325]
    bodies, joints = [], []
    for i, ray in enumerate(rays):
        following = rays[(i + 1) % 6] + (360 if i == 5 else 0)
        middle = (ray + following) / 2
        outline = ring(centre, 0.01, 0.05, ray, following)
        bodies.append(rigid_and_flexible(outline, ring(centre, 0.02, 0.03, middle - 5, middle + 5)))
    # Plate i lies between ray i and ray i + 1; plate 4 is the ground. In the order of the file the walk
    # goes 4 -> 5, 4 -> 3, 5 -> 0, 3 -> 2, 0 -> 1, and ray 2 closes the loop from 2 to 1.
    parents = {0: 5, 1: 0, 2: 2, 3: 3, 4: 4, 5: 4}
    for i in [2, 5, 1, 4, 0, 3]:
        angle = math.radians(rays[i])
        point = lambda r: (centre[0] + r * math.cos(angle), centre[1] + r * math.sin(angle))
        line = [point(0.01), point(0.05)]
        joints.append(dict(line=line if i % 2 else line[::-1], z=0.0009125, bodies=((i + 5) % 6, i), parent=parents[i],
                           stiffness=0.011 + 0.001 * i, damping=4e-06, rest=0 if i else 15, limits=(-180, 180)))
    return FIVE, bodies, [4], joints, 3


def sarrus():
    """Two folded pairs of plates at right angles, in two storeys: the top moves straight up, and of the
    loop's six equations one is redundant. The plates of a pair have different lengths: otherwise the first
    and the third hinge could coincide, and the pair turn by itself."""
    lower = lambda outline, *more: [[(outline, [])], [(outline, []), *more], [(outline, []), *more], [], [], [], []]
    upper = lambda outline, *holes: [[], [], [], [], [(outline, [])], [(outline, [])], [(outline, list(holes))]]
    bodies = [
        lower(box(0, -0.03, 0.03, -0.01)),
        # Several plates in a layer; a spacer in a corner of its own.
        lower(box(-0.04, -0.04, 0, 0), (box(-0.06, -0.04, -0.05, -0.03), [])),
        upper(box(0.006, -0.03, 0.03, -0.01), box(0.01, -0.025, 0.02, -0.015)),
        lower(box(-0.035, 0, -0.01, 0.024)),
        upper(box(-0.035, 0.006, -0.01, 0.024)),
        upper(box(-0.04, -0.04, 0.006, 0.006), [(-0.03, -0.03), (-0.01, -0.03), (-0.02, -0.01)]),
    ]
    low, middle, high = 0.000355, 0.00043, 0.000505
    across = lambda x: [(x, -0.03), (x, -0.01)]
    along = lambda y: [(-0.035, y), (-0.01, y)]
    hinge = lambda line, z, bodies, parent, **others: dict(
        dict(line=line, z=z, bodies=bodies, parent=parent, stiffness=0.002, damping=1e-05, rest=0, limits=(-180, 180)),
        **others)
    joints = [
        hinge(across(0), low, (1, 0), 1),
        hinge(across(0.03), middle, (0, 2), 0, rest=35),
        hinge(across(0.006), high, (5, 2), 2, limits=(-90, 135)),
        hinge(along(0), low, (3, 1), 1, stiffness=0.0025),
        hinge(along(0.024), middle, (3, 4), 3),
        hinge(along(0.006), high, (4, 5), 4, damping=2e-05),
    ]
    return SEVEN, bodies, [1], joints, 5


def moments(polygon):
    """Integrals of 1, x, y, x^2, x y, y^2: positive whichever way round."""
    total = [0.0] * 6
    ox, oy = polygon[0]
    for (ax, ay), (bx, by) in zip(polygon[1:], polygon[2:]):
        area = ((ax - ox) * (by - oy) - (bx - ox) * (ay - oy)) / 2
        for (px, py), (qx, qy) in [((ox, oy), (ax, ay)), ((ax, ay), (bx, by)), ((bx, by), (ox, oy))]:
            x, y = (px + qx) / 2, (py + qy) / 2
            for k, value in enumerate([1, x, y, x * x, x * y, y * y]):
                total[k] += area / 3 * value
    return total if total[0] > 0 else [-value for value in total]


def weigh(layers, stack):
    """Mass, centre, and inertia about it."""
    mass, first, second = 0.0, [0.0] * 3, [[0.0] * 3 for _ in range(3)]
    bottom = 0.0
    for plates, (_, density, thickness) in zip(layers, stack):
        z, zz = bottom + thickness / 2, (bottom + thickness / 2) ** 2 + thickness ** 2 / 12
        bottom += thickness
        for outline, holes in plates:
            for polygon, sign in [(outline, 1), *((hole, -1) for hole in holes)]:
                a, x, y, xx, xy, yy = (sign * density * thickness * value for value in moments(polygon))
                mass += a
                for k, value in enumerate([x, y, a * z]):
                    first[k] += value
                for i, row in enumerate([[xx, xy, x * z], [xy, yy, y * z], [x * z, y * z, a * zz]]):
                    for k, value in enumerate(row):
                        second[i][k] += value
    centre = [value / mass for value in first]
    about = [[second[i][k] - mass * centre[i] * centre[k] for k in range(3)] for i in range(3)]
    trace = sum(about[i][i] for i in range(3))
    return mass, centre, [[(trace if i == k else 0.0) - about[i][k] for k in range(3)] for i in range(3)]


def polygon(outline, holes):
    """As shapely prints it: sixteen decimals, the first corner again at the end."""
    rings = [", ".join(f"{x:.16f} {y:.16f}" for x, y in [*r, r[0]]) for r in [outline, *holes]]
    return "(" + ", ".join(f"({text})" for text in rings) + ")"


def geometry(plates):
    if not plates:
        return "GEOMETRYCOLLECTION EMPTY"
    if len(plates) == 1:
        return "POLYGON " + polygon(*plates[0])
    return "MULTIPOLYGON (" + ", ".join(polygon(*plate) for plate in plates) + ")"


def drawing(stack, bodies, fixed, joints, _):
    """The lines of the file, folded at eighty columns as PyYAML does."""
    identity = lambda body: 1700000000000 + 1117 * body
    lines = [TAG + "DynamicsInfo", "connected_items:"]
    for body, layers in enumerate(bodies):
        lines += [f"- id: {identity(body)}", "  layers:"]
        for layer, plates in enumerate(layers):
            text = f"  - geoms: ['{geometry(plates)}']"
            lines += textwrap.wrap(text, 80, subsequent_indent=" " * 8, break_on_hyphens=False)
            lines.append(f"    id: {1800000000000 + 101 * body + layer}")
    lines.append("connections:")
    for joint in joints:
        (x0, y0), (x1, y1) = joint["line"]
        first, second = map(identity, joint["bodies"])
        low, high = joint["limits"]
        lines += [f"- {TUPLE}", f"  - {TUPLE}", f"    - {TUPLE} [{x0!r}, {y0!r}]", f"    - {TUPLE} [{x1!r}, {y1!r}]",
                  f"  - {TUPLE} [{first}, {second}]",
                  f"  - {TAG}JointProps {{damping: {joint['damping']!r}, limit_neg: {low},",
                  f"    limit_pos: {high}, preload: {float(joint['rest'])!r}, stiffness: {joint['stiffness']!r}, "
                  f"z_pos: {joint['z']!r}}}"]
    lines.append("material_properties:")
    for i, (name, density, thickness) in enumerate(stack):
        colour = f"&id001 {TUPLE} [0.2, 0.2, 0.2, 0.5]" if i == 0 else "*id001"
        lines += [f"- {TAG}MaterialProperty", "  E1: 1", "  E2: 1", f"  color: {colour}", f"  density: {density}",
                  f"  is_adhesive: {str(name == 'adhesive').lower()}", "  is_conductive: false",
                  f"  is_flexible: {str(name in ('film', 'flexible')).lower()}",
                  f"  is_rigid: {str(name in ('card', 'rigid')).lower()}", f"  name: {name}", "  poisson: 0.5",
                  f"  thickness: {thickness!r}"]
    lines.append(f"newtonian_ids: [{', '.join(str(identity(body)) for body in fixed)}]")
    return "\n".join(lines) + "\n"


def numbers(stack, bodies, fixed, joints, rank):
    """The file of expected values."""
    weights = [weigh(layers, stack) for layers in bodies]
    out = []
    for i, joint in enumerate(joints):
        (x0, y0), (x1, y1) = joint["line"]
        length = math.hypot(x1 - x0, y1 - y0)
        child = sum(joint["bodies"]) - joint["parent"]
        out.append(dict(name=f"j{i}", parent=f"b{joint['parent']}", child=f"b{child}",
                        axis=[(x1 - x0) / length, (y1 - y0) / length, 0.0], point=[x0, y0, joint["z"]],
                        stiffness=joint["stiffness"], damping=joint["damping"], rest=math.radians(joint["rest"]),
                        limits=[math.radians(limit) for limit in joint["limits"]]))
    return dict(gravity=[0.0, 0.0, -9.81], rank=rank,
                bodies=[dict(name=f"b{i}", fixed=i in fixed, mass=mass, com=com, inertia=inertia)
                        for i, (mass, com, inertia) in enumerate(weights)],
                joints=out)


def pretty(value):
    """JSON with one body or joint in a line."""
    entries = lambda items: "[\n  " + ",\n  ".join(json.dumps(item) for item in items) + "\n]"
    parts = [f'"{key}": ' + (entries(item) if key in ("bodies", "joints") else json.dumps(item))
             for key, item in value.items()]
    return "{" + ",\n".join(parts) + "}\n"


for make in [pendulum, fourbar, sixbar, sarrus]:
    design = make()
    path = os.path.join(FOLDER, "drawn_" + make.__name__)
    with open(path + ".cad.joints", "w") as file:
        file.write(drawing(*design))
    with open(path + ".json", "w") as file:
        file.write(pretty(numbers(*design)))
