"""The beams and columns of plugins/mechanics/tests/experiments, computed by fibres in OpenSees.

    pip install openseespy numpy      # and libblas3, liblapack3
    python3 plugins/experiments/peers/opensees.py [--law ec2|tension|bricks|popovics] [--only slender] [--check]

Sections, places of loads and supports, and bars that harden are those of our tests (slender.rs, interaction.rs, column.rs, columns.rs, flexure.rs, series.rs, shear.rs,
prestressed.rs, of which only the grouted tendon is a fibre); no test weighs itself there, so none does here. Concrete follows EN 1992-1-1 (3.14) with f_cm up to .0035 and bears nothing past that, nor more than .03 MPa of
tension; bars displace it. Elements are force-based with five points of Gauss and Lobatto, and turn with what they are of (corotational). Displacements are raised.
`--law tension` gives concrete f_ctm, lost at ten times its cracking strain; `--law bricks` loses it as MC2010 does, one crack every 20 mm, as our bricks do
in Kim and Yang's columns; `--law popovics` is Concrete04, which unloads as concrete does. `--check` holds sections against strips added up by
numpy, and an elastic column against the secant formula, instead.
"""

import argparse
import itertools
import math
import os
import time
from dataclasses import dataclass, field

import numpy as np
import openseespy.opensees as ops

YOUNG = 200e9
RIGID = 1e3  # times as stiff as a steel plate
STRIPS = 100
CRUSHED = 3.5e-3
BRICK = 0.02  # of our mesh of Kim and Yang's columns, m
E100 = 2e9  # hardening of bars whose class is not known, Pa


@dataclass
class Section:
    """Width, depth (m), f_cm (MPa), and rows of bars: depth from the top (m), area (m²), yield stress (Pa), slope after that (Pa).

    Tendons: depth (m), area (m²), and their strain where the concrete beside them has none.
    """

    width: float
    depth: float
    fcm: float
    bars: list
    tendons: list = field(default_factory=list)


def class_b(yielding):
    """Slope after yielding up to 1.08 f_y at 5 % (EN 1992-1-1, table C.1)."""
    return 0.08 * yielding / (0.05 - yielding / YOUNG)


# Y1860S7: E, f_p0.1k, f_pk (Pa), and the strain at which it has that.
STRAND = (195e9, 1640e6, 1860e6, 0.035)
STRAND_SLOPE = (STRAND[2] - STRAND[1]) / (STRAND[3] - STRAND[1] / STRAND[0])


def disc(diameter):
    return 0.25 * math.pi * diameter**2


def curve(fcm):
    """E_c, ε_c1 and σ(ε) of EN 1992-1-1 (3.14), compression positive, Pa."""
    first = min(0.7e-3 * fcm**0.31, 2.8e-3)
    young = 1.05 * 22e9 * (0.1 * fcm) ** 0.3
    k = young * first / (1e6 * fcm)

    def stress(strain):
        eta = np.asarray(strain) / first
        inside = (eta >= 0) & (np.asarray(strain) <= CRUSHED)
        return np.where(inside, 1e6 * fcm * (k * eta - eta**2) / (1 + (k - 2) * eta), 0.0)

    return young, first, stress


def concrete(tag, fcm, law):
    young, first, stress = curve(fcm)
    if law == "popovics":
        ops.uniaxialMaterial("Concrete04", tag, -1e6 * fcm, -first, -CRUSHED, young)
        return
    pressed = np.linspace(CRUSHED, 0.0, 71)
    # The last two points on each side are drawn on for ever.
    points = [(-1.0, 0.0), (-CRUSHED - 5e-5, 0.0), *zip(-pressed, -stress(pressed))]
    # A trace of tension, so that the first step has a stiffness.
    fct = 0.03e6 if law == "ec2" else 0.3e6 * max(fcm - 8.0, 0.6 * fcm) ** (2 / 3)
    points.append((fct / young, fct))
    if law == "bricks":
        knee = 73.0 * fcm**0.18 / fct / BRICK
        points += [(fct / young + knee, 0.2 * fct), (fct / young + 5 * knee, 0.0)]
    else:
        points.append((10 * fct / young, 0.0))
    points += [(0.1, 0.0), (1.0, 0.0)]
    strains, stresses = zip(*((float(e), float(s)) for e, s in points))
    ops.uniaxialMaterial("ElasticMultiLinear", tag, "-strain", *strains, "-stress", *stresses)


def begin(section, law):
    """A plane model with that section as number 1."""
    ops.wipe()
    ops.model("basic", "-ndm", 2, "-ndf", 3)
    concrete(1, section.fcm, law)
    ops.section("Fiber", 1)
    strip = section.depth / STRIPS
    for i in range(STRIPS):
        ops.fiber(0.5 * section.depth - (i + 0.5) * strip, 0.0, section.width * strip, 1)
    for tag, (down, area, yielding, slope) in enumerate(section.bars, 2):
        ops.uniaxialMaterial("Steel01", tag, yielding, YOUNG, slope / YOUNG)
        ops.fiber(0.5 * section.depth - down, 0.0, area, tag)
        ops.fiber(0.5 * section.depth - down, 0.0, -area, 1)
    for tag, (down, area, locked) in enumerate(section.tendons, 50):
        ops.uniaxialMaterial("Steel01", 50 + tag, STRAND[1], STRAND[0], STRAND_SLOPE / STRAND[0])
        ops.uniaxialMaterial("InitStrainMaterial", tag, 50 + tag, locked)
        ops.fiber(0.5 * section.depth - down, 0.0, area, tag)
        ops.fiber(0.5 * section.depth - down, 0.0, -area, 1)
    ops.geomTransf("Corotational", 1)
    ops.beamIntegration("Lobatto", 1, 1, 5)


def line(places, largest, integration=1):
    """Elements along x through these places, cut where longer than `largest`; the nodes at the places."""
    ops.node(1, places[0], 0.0)
    named, last = [1], 1
    for a, b in itertools.pairwise(places):
        cuts = math.ceil((b - a) / largest - 1e-9)
        for k in range(1, cuts + 1):
            last += 1
            ops.node(last, a + (b - a) * k / cuts, 0.0)
            ops.element("forceBeamColumn", last - 1, last - 1, last, 1, integration)
        named.append(last)
    return named


def pattern(tag, loads):
    """Forces (x, y, moment) at nodes; what was there before stays."""
    ops.loadConst("-time", 0.0)
    ops.timeSeries("Linear", tag)
    ops.pattern("Plain", tag, tag)
    for node, force in loads:
        ops.load(node, *force)


def solver(integrator, *words):
    ops.wipeAnalysis()
    ops.system("BandGeneral")
    ops.numberer("RCM")
    ops.constraints("Plain")
    ops.test("NormDispIncr", 1e-8, 25)
    ops.algorithm("Newton")
    ops.integrator(integrator, *words)
    ops.analysis("Static")


def press(loads):
    """Loads that stay."""
    pattern(1, loads)
    solver("LoadControl", 0.02)
    if ops.analyze(50) != 0:
        raise SystemExit("no equilibrium under the load that stays")


def pushed(loads, node, component, last, see, steps=250, stiffens=False):
    """What `see(factor, displacement)` tells after every step, up to `last` or until a tenth of the highest factor is lost."""
    pattern(2, loads)
    seen, top, cut, before, stiffest = [], 0.0, 1, 0.0, None
    while abs(at := ops.nodeDisp(node, component)) < abs(last):
        solver("DisplacementControl", node, component, last / steps / cut)
        done = False
        for way in (("Newton",), ("KrylovNewton",), ("NewtonLineSearch",)):
            ops.algorithm(*way)
            if done := ops.analyze(1) == 0:
                break
        if not done:
            cut *= 4
            if cut > 64:
                break
            continue
        stepped = abs(ops.nodeDisp(node, component) - at)
        at, factor = ops.nodeDisp(node, component), ops.getTime()
        stiffest = stiffest or factor / stepped
        if not stiffens and factor - before > 1.5 * stiffest * stepped:
            break  # stiffer than at first: Newton has found another branch
        before = factor
        seen.append((factor, see(factor, at)))
        top, cut = max(top, factor), max(1, cut // 2)
        if factor < 0.9 * top:
            break
    return seen


def highest(seen):
    return max(seen, key=lambda s: s[0])


# Measured figures and sections; their sources stand in the tests of the same names.

KIM_YANG = [
    ("10L4", 0.24, 8, (109.5, 109.3)),
    ("60L2", 1.44, 4, (63.7, 65.7)),
    ("100L2", 2.4, 4, (38.2, 35.0)),
    ("100L4", 2.4, 8, (49.0, 47.0)),
]


def kim_yang(length, count, law, elastic=None):
    """Load (kN) against the sway of the middle (mm), and the height between hinges. Half is computed, ended by 20 mm of steel and a rigid arm."""
    side, off, plate = 0.08, 0.024, 0.02
    rows = {4: (2, 0, 2), 8: (3, 2, 3)}[count]
    bars = [(d, n * 31.7e-6, 387e6, E100) for d, n in zip((0.015, 0.5 * side, side - 0.015), rows) if n]
    begin(Section(side, side, 25.5, bars), law)
    if elastic:
        ops.section("Elastic", 2, elastic, side**2, side**4 / 12)
        ops.beamIntegration("Lobatto", 2, 2, 5)
    middle, top = line([0.0, 0.5 * length], 0.12, 2 if elastic else 1)
    ops.fix(middle, 1, 0, 1)
    end, hinge = top + 1, top + 2
    ops.node(end, 0.5 * length + plate, 0.0)
    ops.node(hinge, 0.5 * length + plate, off)
    ops.fix(hinge, 0, 1, 0)
    for tag, ends, times in ((end, (top, end), 1.0), (hinge, (end, hinge), RIGID)):
        ops.element("elasticBeamColumn", tag, *ends, times * side**2, YOUNG, times * side**4 / 12, 1)
    whole = length + 2 * plate
    seen = pushed([(hinge, (-1e3, 0.0, 0.0))], middle, 2, -0.02 * whole**2, lambda f, d: -1e3 * d)
    return seen, whole


def slender(law):
    """What was measured, what OpenSees says, what else, and the clock from which it took."""
    for name, length, count, measured in KIM_YANG:
        clock = time.process_time()
        load, sway = highest(kim_yang(length, count, law)[0])
        yield f"Kim and Yang, {name}", sum(measured) / 2, load, f"kN at a sway of {sway:.1f} mm", clock


JANNEY = Section(0.1524, 0.3048, 36.2, [(0.2108, 600e-6, 333e6, E100)])


def janney(law):
    """Half of the beam from its end to midspan, loaded on both edges of a plate."""
    clock = time.process_time()
    span, plate, long = 2.7432, 0.0762, 1.524
    third = span / 3
    begin(JANNEY, law)
    load = long - 0.5 * third
    _, support, left, right, middle = line([0.0, long - 0.5 * span, load - 0.5 * plate, load + 0.5 * plate, long], 0.1)
    ops.fix(support, 0, 1, 0)
    ops.fix(middle, 1, 0, 1)
    down, _, yielding, _ = JANNEY.bars[0]
    # Curvature turns about the centroid of the fibres' areas, which is the middle of the depth: bars replace as much concrete.
    up = 0.5 * JANNEY.depth - down

    def see(factor, at):
        elongation, curvature = ops.eleResponse(middle - 1, "section", 5, "deformation")
        return -1e3 * at, elongation - up * curvature

    seen = pushed([(n, (0.0, -0.5e3, 0.0)) for n in (left, right)], middle, 2, -45e-3, see, 450)
    moments = np.array([third * f for f, _ in seen])
    sag, strain = np.array([s for _, s in seen]).T
    yields = int(np.argmax(strain * YOUNG >= yielding))
    top = int(np.argmax(moments))
    yield "Janney, bars yield", 37.0, moments[yields], f"kNm at {sag[yields]:.1f} mm", clock
    yield "Janney, at 12 mm", 37.1, float(np.interp(12.0, sag, moments)), "kNm", clock
    yield "Janney, peak", 41.5, moments[top], f"kNm at {sag[top]:.1f} mm; by strips {by_strips(JANNEY, 0.0):.1f}", clock


SOESIANAWATI = Section(
    0.4,
    0.4,
    46.5,
    [(d, n * disc(0.016), 446e6, E100) for d, n in ((0.028, 4), (0.028 + 0.344 / 3, 2), (0.372 - 0.344 / 3, 2), (0.372, 4))],
)


def soesianawati(law):
    clock = time.process_time()
    begin(SOESIANAWATI, law)
    foot, tip = line([0.0, 1.6], 0.2)
    ops.fix(foot, 1, 1, 1)
    press([(tip, (-744e3, 0.0, 0.0))])
    load, at = highest(pushed([(tip, (0.0, 1e3, 0.0))], tip, 2, 60e-3, lambda f, d: 1e3 * d))
    strips = (by_strips(SOESIANAWATI, 744e3) - 0.744 * at) / 1.6
    yield "Soesianawati", 192.9, load, f"kN at {at:.1f} mm; by strips {strips:.1f}", clock


def rows(depth, cover, tie, bar, counts, yielding):
    """Rows of bars, the outer ones inside of ties."""
    first = 1e-3 * (cover + tie + bar / 2)
    places = np.linspace(first, depth - first, len(counts))
    return [(float(d), n * disc(1e-3 * bar), yielding, class_b(yielding)) for d, n in zip(places, counts)]


# Section, span (m), axial load, and the largest lateral forces (kN).
YOSHIMURA = Section(0.3, 0.3, 30.7, rows(0.3, 31, 6, 16, (4, 2, 2, 4), 402e6))
WIGHT = Section(0.152, 0.305, 34.7, rows(0.305, 35, 6.3, 19, (2, 2), 496e6))
CANTILEVERS = {
    "Yoshimura No. 1 and No. 3": (YOSHIMURA, 0.6, 552.6, (237.0, 229.3)),
    "Wight 40.033a": (WIGHT, 0.876, 189.0, (98.8, 101.3)),
}


def columns(law):
    for name, (section, span, axial, measured) in CANTILEVERS.items():
        clock = time.process_time()
        begin(section, law)
        foot, tip = line([0.0, span], span / 4)
        ops.fix(foot, 1, 1, 1)
        press([(tip, (-1e3 * axial, 0.0, 0.0))])
        load, at = highest(pushed([(tip, (0.0, 1e3, 0.0))], tip, 2, 0.06 * span, lambda f, d: 1e3 * d))
        strips = (by_strips(section, 1e3 * axial) - 1e-3 * axial * at) / span
        yield name, sum(measured) / 2, load, f"kN at {at:.1f} mm, in bending; by strips {strips:.1f}", clock


def prestressed(law):
    """Half of the beam of prestressed.rs, its tendon grouted, against strips: nothing was measured."""
    clock = time.process_time()
    width, depth, fcm, span, plate, down, area, jacked = 0.2, 0.4, 38.0, 4.8, 0.1, 0.3, 200e-6, 1150e6
    young, _, _ = curve(fcm)
    off = down - depth / 2
    shortened = jacked * area * (1 / (width * depth) + 12 * off**2 / (width * depth**3)) / young
    bars = [(d, 2 * 78.5e-6, 500e6, class_b(500e6)) for d in (0.043, depth - 0.043)]
    section = Section(width, depth, fcm, bars, [(down, area, jacked / STRAND[0] + shortened)])
    begin(section, law)
    long = span / 2 + 0.2
    _, support, *pressed = line([0.0, 0.2, *np.linspace(long - plate, long, 5)], 0.2)
    ops.fix(support, 0, 1, 0)
    ops.fix(pressed[-1], 1, 0, 1)
    press([])
    weights = np.array([0.5, 1, 1, 1, 0.5]) / 4
    loads = [(n, (0.0, -1e3 * w, 0.0)) for n, w in zip(pressed, weights)]
    # The tendon opens the upper edge, which bears no tension here; the load shuts it again.
    load, sag = highest(pushed(loads, pressed[-1], 2, -0.03 * span, lambda f, d: -1e3 * d, 400, stiffens=True))
    yield "post-tensioned, grouted", 4 * by_strips(section, 0.0) / (span - plate), 2 * load, f"kN at {sag:.1f} mm; against strips", clock


COLUMN = Section(0.4, 0.4, 38.0, [(d, n * disc(0.02), 500e6, class_b(500e6)) for d, n in ((0.05, 3), (0.2, 2), (0.35, 3))])


def bent(axial, law):
    """Moment at midspan, its sag and the rise of the pressed end at the jack's highest load, kNm and mm."""
    half, arm, beyond, plate = 2.2, 1.5, 0.2, 0.1
    begin(COLUMN, law)
    jack = beyond + arm
    start, support, *pressed, middle = line([0.0, beyond, *np.linspace(jack - plate, jack + plate, 5), beyond + half], 0.25)
    ops.fix(support, 0, 1, 0)
    ops.fix(middle, 1, 0, 1)
    press([(start, (1e3 * axial, 0.0, 0.0))])

    def see(factor, at):
        ops.reactions()
        return abs(1e-3 * ops.nodeReaction(middle, 3)), -1e3 * at, 1e3 * ops.nodeDisp(start, 2)

    weights = np.array([0.5, 1, 1, 1, 0.5]) / 4
    seen = pushed([(n, (0.0, -1e3 * w, 0.0)) for n, w in zip(pressed, weights)], middle, 2, -80e-3, see, 200)
    return highest(seen)[1]


def interaction(law):
    for axial in (0, 1000, 2000, 3500):
        clock = time.process_time()
        moment, sag, rise = bent(axial, law)
        words = f"kNm at {sag:.1f} mm, end risen {rise:.1f} mm; against strips"
        yield f"N {axial} kN, M", by_strips(COLUMN, 1e3 * axial), moment, words, clock


# Width, depth, span (mm), f_cm, No. 9 bars in two rows, measured (kN).
BEAMS = {
    "A1": (307, 561, 3660, 24.1, 2, 2, 467),
    "A3": (307, 561, 6400, 35.1, 3, 3, 467),
    "B1": (231, 556, 3660, 24.8, 2, 2, 445),
    "B3": (229, 556, 6400, 38.8, 3, 2, 356),
    "A2": (305, 559, 4570, 24.3, 3, 2, 489),
    "B2": (229, 561, 4570, 23.2, 2, 2, 400),
    "C1": (155, 559, 3660, 29.6, 1, 1, 311),
    "C2": (152, 559, 4570, 23.8, 2, 2, 325),
    "C3": (155, 554, 6400, 35.1, 2, 2, 269),
}


def in_the_middle(name, section, span, measured, words, law):
    """Half of a beam that a plate of 150 mm loads in its middle."""
    clock = time.process_time()
    begin(section, law)
    long = 0.5 * span + 0.22
    _, support, *plate = line([0.0, 0.22, *np.linspace(long - 0.075, long, 5)], 0.2)
    ops.fix(support, 0, 1, 0)
    ops.fix(plate[-1], 1, 0, 1)
    weights = np.array([0.5, 1, 1, 1, 0.5]) / 4
    loads = [(n, (0.0, -1e3 * w, 0.0)) for n, w in zip(plate, weights)]
    load, sag = highest(pushed(loads, plate[-1], 2, -0.02 * span, lambda f, d: -1e3 * d, 400))
    strips = 2 * by_strips(section, 0.0) / (0.5 * span - 0.0375)
    yield name, measured, 2 * load, f"kN at {sag:.1f} mm{words}; by strips {strips:.1f}", clock


def series(law):
    for name, (width, depth, span, fcm, low, up, measured) in BEAMS.items():
        area, small, depth = disc(28.7e-3), disc(12.7e-3), 1e-3 * depth
        rows = [(55.95e-3, 2 * small, 345e6), (depth - 126.95e-3, up * area, 555e6), (depth - 63.95e-3, low * area, 555e6)]
        section = Section(1e-3 * width, depth, fcm, [(*row, class_b(row[2])) for row in rows])
        # The third of each width is the longest, and was crushed.
        words = ", in bending (it failed in shear)" if name[1] != "3" else ""
        yield from in_the_middle(name, section, 1e-3 * span, measured, words, law)


def oa1(law):
    section = Section(0.305, 0.552, 22.6, [(0.552 - 0.128, 1000e-6, 440e6, E100), (0.552 - 0.064, 1400e-6, 440e6, E100)])
    yield from in_the_middle("OA1", section, 3.66, 332, ", in bending (it failed in shear)", law)


TESTS = (slender, interaction, soesianawati, columns, janney, oa1, series, prestressed)

# Second ways.


def resultants(section, top, curvature):
    """Force (compression) and moment about the middle, by strips."""
    _, _, stress = curve(section.fcm)
    down = section.depth * (np.arange(400) + 0.5) / 400
    force = stress(top - curvature * down) * section.width * section.depth / 400
    n, m = force.sum(), force @ (0.5 * section.depth - down)
    for d, area, yielding, slope in section.bars:
        strain = top - curvature * d
        steel = YOUNG * strain
        if abs(steel) > yielding:
            steel = math.copysign(yielding + slope * (abs(strain) - yielding / YOUNG), strain)
        f = area * (steel - float(stress(strain)))
        n, m = n + f, m + f * (0.5 * section.depth - d)
    for d, area, locked in section.tendons:
        strain = top - curvature * d
        over = locked - strain - STRAND[1] / STRAND[0]
        pull = STRAND[1] + STRAND_SLOPE * over if over > 0 else STRAND[0] * (locked - strain)
        f = -area * (pull + float(stress(strain)))
        n, m = n + f, m + f * (0.5 * section.depth - d)
    return n, m


def by_strips(section, axial):
    """The largest moment under an axial force, kNm."""
    most = 0.0
    for curvature in np.geomspace(2e-3, 0.12, 300):
        low, high = 0.0, next((t for t in np.linspace(0, 3.6e-3, 61) if resultants(section, t, curvature)[0] >= axial), None)
        if high is None:
            continue
        for _ in range(50):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if resultants(section, middle, curvature)[0] < axial else (low, middle)
        most = max(most, resultants(section, high, curvature)[1])
    return 1e-3 * most


def of_section(section, axial, law):
    """The same of OpenSees' section alone."""
    begin(section, law)
    for node in (1, 2):
        ops.node(node, 0.0, 0.0)
    ops.fix(1, 1, 1, 1)
    ops.fix(2, 0, 1, 0)
    ops.element("zeroLengthSection", 1, 1, 2, 1)
    if axial:
        press([(2, (-axial, 0.0, 0.0))])
    return highest(pushed([(2, (0.0, 0.0, 1e3))], 2, 3, 0.06, lambda f, d: d))[0]


def check(law):
    worst = 0.0
    for axial in (0.0, 1e6, 2e6, 3.5e6):
        ours, theirs = by_strips(COLUMN, axial), of_section(COLUMN, axial, law)
        worst = max(worst, abs(theirs / ours - 1))
        print(f"section, N {1e-3 * axial:.0f} kN: strips {ours:.1f} kNm, OpenSees {theirs:.1f}: {theirs / ours:.4f}")
    # An elastic column, hinges off its axis: δ = e (sec(π/2 √(P/P_E)) − 1).
    young = 30e9
    seen, whole = kim_yang(2.4, 4, law, young)
    euler = 1e-3 * math.pi**2 * young * 0.08**4 / 12 / whole**2
    for share in (0.3, 0.6, 0.8):
        wanted = 24.0 * (1 / math.cos(0.5 * math.pi * math.sqrt(share)) - 1)
        load = float(np.interp(wanted, [s for _, s in seen], [f for f, _ in seen]))
        worst = max(worst, abs(load / (share * euler) - 1))
        print(f"elastic column, P/P_E {share}: {share * euler:.2f} kN by the secant formula, OpenSees {load:.2f}: {load / (share * euler):.4f}")
    print(f"farthest {100 * worst:.2f} %")
    if worst > 0.01:
        raise SystemExit("off by more than 1 %")


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--law", choices=("ec2", "tension", "bricks", "popovics"), default="ec2")
    arguments.add_argument("--only", choices=[t.__name__ for t in TESTS])
    arguments.add_argument("--check", action="store_true")
    given = arguments.parse_args()
    ops.logFile(os.devnull, "-noEcho")  # steps that are tried again say so
    print(f"OpenSees {ops.version()}, concrete by {given.law}")
    if given.check:
        check(given.law)
        return
    for test in TESTS:
        if given.only in (None, test.__name__):
            for name, measured, found, words, clock in test(given.law):
                print(f"{name:28} {measured:7.1f} {found:7.1f} {found / measured:6.3f}  {time.process_time() - clock:5.2f} CPU-s  {words}", flush=True)


if __name__ == "__main__":
    main()
