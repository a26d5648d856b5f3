"""Runs the Python blocks of a page, and compares the model they write with what shapely computes.

python page.py PAGE LAMC
"""

import os
import pathlib
import re
import subprocess
import sys
import tempfile

import yaml
from foldable_robotics.dynamics_info import DynamicsInfo, JointProps, MaterialProperty

MM = 1e-3


def lamc(*arguments):
    """What a command prints."""
    return subprocess.run([LAMC, *arguments], check=True, capture_output=True, text=True).stdout


def masses(path):
    """The mass of each body, g, as `lamc check` prints it."""
    rows = re.findall(r"^(\w+)(?: \(fixed\))? +([0-9.]+) +\S+ \S+ \S+ +", lamc("check", path), re.M)
    return {name: float(mass) for name, mass in rows}


def exported(laminate):
    """What `Laminate.export_dict` returns, which needs shapely 1.8 in version 0.0.37 of the package."""
    layers = [{"geoms": [shape.wkt for shape in layer.geoms], "id": layer.id} for layer in laminate.layers]
    return {"id": laminate.id, "layers": layers}


def near(found, expected, what):
    """Both numbers agree to the digits that are printed."""
    assert abs(found - expected) <= 2e-5 * max(abs(expected), 1e-9) + 1e-5, f"{what}: {found} is not {expected}"


def main(page):
    blocks = re.findall(r"^```python\n(.*?)^```", page, re.M | re.S)
    assert len(blocks) == 2, f"{len(blocks)} blocks of Python"
    names = {}
    for block in blocks:
        exec(block, names)

    layers = [(700, 0.3), (1380, 0.05), (700, 0.3)]
    expected = {}
    for name in ["base", "arm"]:
        areas = [sum(shape.area for shape in layer.geoms) for layer in names[name].layers]
        grams = [density * thickness * area * 1e-6 for (density, thickness), area in zip(layers, areas)]
        expected[name] = sum(grams)
    found = masses("flap.yaml")
    assert set(found) == set(expected), found
    for name, mass in expected.items():
        near(found[name], mass, name)

    # Outlines, holes and the film that bridges the hinge.
    table = lamc("cut", "flap.yaml", "--svg", "flap_#.svg").splitlines()
    rows = {row.split()[0]: [float(x) for x in row.split()[1:]] for row in table if re.match(r"\d_", row)}
    card = sum(shape.area for body in ["base", "arm"] for shape in names[body].layers[0].geoms)
    film = sum(shape.area for body in ["base", "arm"] for shape in names[body].layers[1].geoms)
    assert rows["1_card"][:3] == [2, 1, 0] and rows["2_film"][:3] == [1, 1, 0], rows
    assert abs(rows["1_card"][3] - card) <= 0.06 and abs(rows["2_film"][3] - film) <= 0.06, rows

    # The other way, a DynamicsInfo in metres, is the same mechanism.
    bodies = [names[name].copy().scale(MM, MM) for name in ["base", "arm"]]
    materials = [
        MaterialProperty(name, (0, 0, 0, 1), thickness * MM, 1, 1, density, 0.3, False, False, False, False)
        for name, (density, thickness) in zip(["card", "film", "card"], layers)
    ]
    line = ((30 * MM, 0.0), (30 * MM, 20 * MM))
    joint = JointProps(5e-3, 0.0, 0.0, -180, 180, 0.325 * MM)
    info = DynamicsInfo(
        [exported(body) for body in bodies],
        [(line, (bodies[0].id, bodies[1].id), joint)],
        [bodies[0].id],
        materials,
    )
    pathlib.Path("info.joints").write_text(yaml.dump(info))
    for (body, mass), name in zip(masses("info.joints").items(), ["base", "arm"]):
        near(mass, expected[name], f"{body} of the DynamicsInfo")
    print(f"masses (g): {found}; areas and the DynamicsInfo agree")


if __name__ == "__main__":
    text, LAMC = pathlib.Path(sys.argv[1]).read_text(), os.path.abspath(sys.argv[2])
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        main(text)
