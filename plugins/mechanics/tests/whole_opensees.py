#!/usr/bin/env python3
"""The bridge as one frame in OpenSees: beams after Timoshenko, plates as ASDShellQ4, rigid links; held against what the test
`frame::peer` has left in a folder (`INTRADOS_KEEP`): its deck `whole.inp` and its displacements `moved.csv`.

Plates bend by MITC there as here, and both have a membrane that bends in its plane without locking. (With ShellMITC4, whose membrane is
the plain bilinear one, walls are 4 % stiffer.)

    pip install openseespy numpy      # and libblas3, liblapack3
    python3 whole_opensees.py FOLDER
"""

import csv
import pathlib
import re
import sys

import numpy as np
import openseespy.opensees as ops

GRAVITY = 9.81
folder = pathlib.Path(sys.argv[1])
deck = (folder / "whole.inp").read_text()


def numbers(line):
    return [float(x) for x in line.split(",")]


def matter(name):
    young, density = re.search(rf"NAME={name}\n\*ELASTIC\n([^,]*),.*\n\*DENSITY\n(.*)", deck).groups()
    return float(young), float(density)


rows = (line.split(",") for line in deck.split("*ELEMENT")[0].splitlines()[1:])
place = {int(n): np.array([float(x) for x in xyz]) for n, *xyz in rows}
elements = [
    (kind, tag, [int(x) for x in line.split(",")[1:]])
    for kind, tag, line in re.findall(r"\*ELEMENT, TYPE=(\w+), ELSET=E(\d+)\n(.*)\n", deck)
]
sections = {
    tag: (name, numbers(size), np.array(numbers(way)))
    for tag, name, size, way in re.findall(
        r"\*BEAM SECTION, ELSET=E(\d+), MATERIAL=(\w+), SECTION=RECT\n(.*)\n(.*)\n", deck
    )
}
thickness = dict(re.findall(r"\*SHELL SECTION, ELSET=E(\d+), MATERIAL=CONCRETE\n(.*)\n", deck))
ground = {int(n) for n in re.search(r"NSET=GROUND\n((?:\d+\n)+)", deck)[1].split()}
young, density = matter("CONCRETE")

ops.wipe()
ops.model("basic", "-ndm", 3, "-ndf", 6)
used = {n for kind, _, nodes in elements for n in (nodes[::2] if kind == "B32" else nodes)}
for n in sorted(used):
    ops.node(n, *place[n])
for n in ground:
    ops.fix(n, *[1] * 6)
load = {n: np.zeros(6) for n in used}
links = []
for kind, tag, nodes in elements:
    e = int(tag)
    if kind == "B32":
        (i, _, j), (name, (high, wide), way) = nodes, sections[tag]
        if name == "RIGID":
            links.append((i, j))
            continue
        along = place[j] - place[i]
        unit = along / np.linalg.norm(along)
        y = way - way.dot(unit) * unit
        area, second_z, second_y = high * wide, wide * high**3 / 12, high * wide**3 / 12
        # The test's own: no contraction, all of the area in shear, and a section that warps by y z.
        torsion = 4 * second_y * second_z / (second_y + second_z)
        ops.geomTransf("Linear", e, *np.cross(unit, y))
        beam = (young, young / 2, area, torsion, second_y, second_z, area, area, e)
        ops.element("ElasticTimoshenkoBeam", e, i, j, *beam)
        half = -0.5 * density * GRAVITY * area * np.linalg.norm(along) * np.array([0, 1, 0])
        turn = np.cross(along, half) / 6
        load[i] += np.concatenate([half, turn])
        load[j] += np.concatenate([half, -turn])
    else:
        t = float(thickness[tag])
        ops.section("ElasticMembranePlateSection", e, young, 0.0, t, 0.0)
        ops.element("ASDShellQ4", e, *nodes, e)
        a, b, c, d = (place[n] for n in nodes)
        for n in nodes:
            load[n][1] -= density * GRAVITY * t * np.linalg.norm(np.cross(c - a, d - b)) / 8
for i, j in links:
    ops.rigidLink("beam", i, j)
for line in re.search(r"\*CLOAD\n(.*?)\*NODE PRINT", deck, re.S)[1].splitlines():
    n, component, force = line.split(",")
    load[int(n)][int(component) - 1] += float(force)
ops.timeSeries("Linear", 1)
ops.pattern("Plain", 1, 1)
for n, force in sorted(load.items()):
    ops.load(n, *force)
ops.constraints("Transformation")
ops.numberer("RCM")
ops.system("UmfPack")
ops.algorithm("Linear")
ops.integrator("LoadControl", 1.0)
ops.analysis("Static")
assert ops.analyze(1) == 0

members = {}
for row in csv.DictReader((folder / "moved.csv").open()):
    ours = np.array([float(row[c]) for c in ("x_m", "y_m", "z_m")])
    theirs = np.array(ops.nodeDisp(int(row["node"]))[:3])
    members.setdefault((row["kind"], row["member"]), []).append((ours, theirs))
print(f"{'member':36} {'ours mm':>9} {'OpenSees':>9} {'off %':>7}")
worst = 0.0
for (kind, name), pairs in members.items():
    ours, theirs = max(pairs, key=lambda p: np.linalg.norm(p[0]))
    off = np.linalg.norm(ours - theirs) / np.linalg.norm(ours)
    worst = max(worst, off)
    sizes = [1e3 * np.linalg.norm(v) for v in (ours, theirs)]
    print(f"{kind + ' ' + name:36} {sizes[0]:9.5f} {sizes[1]:9.5f} {100 * off:7.3f}")
most = max(np.linalg.norm(o) for pairs in members.values() for o, _ in pairs)
far = max(np.linalg.norm(o - t) for pairs in members.values() for o, t in pairs)
print(f"largest difference of a member's largest displacement {100 * worst:.2f} %")
print(f"largest difference of any node over the largest displacement {100 * far / most:.3f} %")
ops.reactions()
for n in sorted(ground):
    print(f"ground {n - 1}:", np.round(ops.nodeReaction(n)[:3]))
