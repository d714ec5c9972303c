"""Decks of others, computed by CalculiX and by us: which are read, and whether both say the same.

    python3 plugins/experiments/peers/decks.py target/release/intrados FOLDER table.csv

FOLDER holds .inp files, such as CalculiX' own (Debian: calculix-ccx-test, unpacked) or those of FreeCAD's tests (src/Mod/Fem/femtest/data/calculix).
`ccx` is looked for in PATH, or named by CCX. What a deck prints is replaced by displacements of all nodes and stresses at all points at the end of every step,
in global axes; by temperatures of all nodes in steps of heat; eigenvalues are those of the list that CalculiX writes. A deck agrees where the largest difference
over the largest value is at most 1e-4, for displacements, for stresses and for temperatures, in every step, and where every eigenvalue differs by at most 1e-4 of
itself. Values that are nothing but rounding agree: stresses below those of a strain of 1e-10. CalculiX writes seven digits. Where its stresses are at other points than ours only displacements are compared, and the table says so.
"""

import base64
import csv
import os
import re
import struct
import subprocess
import sys
import tempfile
from pathlib import Path

AGREES = 1e-4
# Strain whose stress is nothing.
NOTHING_STRAINED = 1e-10
# Seconds that a deck may take us.
LONG = 300
PRINTS = ("CONTROLS", "NODEPRINT", "ELPRINT", "NODEFILE", "ELFILE", "CONTACTFILE", "CONTACTPRINT", "SECTIONPRINT", "FACEPRINT", "NODEOUTPUT", "ELEMENTOUTPUT")
NODES, POINTS = "*NODE PRINT,NSET=ZZALL,GLOBAL=YES,FREQUENCY=100000", "*EL PRINT,ELSET=ZZALL,GLOBAL=YES,FREQUENCY=100000"
# What a step without these is asked for would be printed for every mode.
NOTHING = ["*NODE PRINT,FREQUENCY=0", "*EL PRINT,FREQUENCY=0"]
PROCEDURES = ("STATIC", "FREQUENCY", "BUCKLE", "HEATTRANSFER")
KINDS = ("displacements", "stresses", "temperatures", "eigenvalues")


def keyword(line):
    return line[1:].split(",")[0].replace(" ", "").upper() if line.startswith("*") and not line.startswith("**") else None


def number(word):
    """Fortran leaves out the E of exponents of three digits."""
    return float(re.sub(r"(?<=\d)([+-]\d{3})$", r"E\1", word))


def named(kind, numbers):
    """A set of these numbers: CalculiX prints what memory holds for elements that a range names and nobody defined."""
    rows = [", ".join(map(str, numbers[i : i + 8])) for i in range(0, len(numbers), 8)]
    return "\n".join([f"*{kind},{kind}=ZZALL", *rows])


def asked(procedure, elements):
    """What a step of this card prints."""
    name = keyword(procedure) or ""
    if name in ("FREQUENCY", "BUCKLE"):
        return NOTHING
    if name == "HEATTRANSFER":
        return [NODES, "NT"]
    return [NODES, "U", POINTS, "S"] if elements else [NODES, "U"]


def printing(text, nodes, elements):
    """The deck, printing what is compared and nothing else."""
    lines, inside, skip, procedure = [], False, False, ""
    for line in text.splitlines():
        name = keyword(line)
        if name:
            skip = name in PRINTS
            if name == "STEP" and not inside:
                inside = True
                lines.append(named("NSET", nodes))
                if elements:
                    lines.append(named("ELSET", elements))
            if name in PROCEDURES:
                procedure = line
            if name == "ENDSTEP":
                lines += asked(procedure, elements)
        if not skip:
            lines.append(line)
    return "\n".join(lines) + "\n"


def blocks(text):
    """Blocks of the numbers that CalculiX printed, by kind and in order."""
    found, kind, into = {kind: [] for kind in KINDS}, None, None
    for line in text.splitlines():
        words, head = line.split(), line.strip().replace(" ", "")
        begun = next((k for k in KINDS if line.strip().startswith(k)), None)
        if head in ("EIGENVALUEOUTPUT", "BUCKLINGFACTOROUTPUT"):
            begun = "eigenvalues"
        if begun:
            kind, into = begun, {}
            found[kind].append(into)
        elif into is not None and words and words[0].isdigit():
            keys = 2 if kind == "stresses" else 1
            last = 2 if kind == "eigenvalues" else None
            into[tuple(map(int, words[:keys]))] = [number(w) for w in words[keys:last]]
        elif words and kind != "eigenvalues":
            into = None
        elif into:
            # An empty line ends a list that has begun.
            into = None
    return found


def theirs(program, deck, room, found):
    """What CalculiX says of every step; its complaint where it fails."""
    parts = [found["displacements"], found["temperatures"], found["stresses"]]
    nodes = sorted({key[0] for steps in parts[:2] for key in (steps[0] if steps else ())})
    elements = sorted({key[0] for key in (parts[2][0] if parts[2] else ())})
    (room / "deck.inp").write_text(printing(deck.read_text(errors="replace"), nodes, elements))
    try:
        ran = subprocess.run([program, "-i", "deck"], cwd=room, capture_output=True, text=True, timeout=300, errors="replace")
    except subprocess.TimeoutExpired:
        return None, "longer than five minutes"
    data = room / "deck.dat"
    if ran.returncode or not data.exists():
        complaint = next((line.strip() for line in ran.stdout.splitlines() if "*ERROR" in line), "")
        return None, complaint or f"it ends with {ran.returncode}"
    return blocks(data.read_text()), ""


def array(text, name):
    """A field of a VTU file."""
    found = re.search(rf'Name="{name}"[^>]*>([^<]*)<', text)
    # Eight bytes say how many follow.
    raw = base64.b64decode(found[1].strip())[8:]
    return struct.unpack(f"<{len(raw) // 8}d", raw)


def of_members(deck, out):
    """Displacements of a deck that was computed as members are, at its end."""
    files = sorted(out.glob("*.vtu"), key=lambda p: p.stat().st_mtime)
    vtu = max((p for p in files if 'Name="displacement_m"' in p.read_text()), key=lambda p: p.name)
    values, labels, card = array(vtu.read_text(), "displacement_m"), [], ""
    for line in deck.read_text(errors="replace").splitlines():
        card = keyword(line) or card
        if card == "NODE" and re.match(r"\s*\d+\s*,", line):
            labels.append(int(line.split(",")[0]))
    return {(n,): list(values[3 * i : 3 * i + 3]) for i, n in enumerate(labels) if 3 * i + 3 <= len(values)}


def ours(program, deck, out):
    """The same by us; the line that we refuse it with."""
    try:
        ran = subprocess.run([program, "analyze", deck, "--units", "m,N", "--out", out, "--quiet"], capture_output=True, text=True, timeout=LONG)
    except subprocess.TimeoutExpired:
        return None, f"{deck.name}: not done in {LONG} s"
    if ran.returncode not in (0, 4) or not (out / "analyze.json").exists():
        lines = ran.stderr.strip().splitlines() or ["it ends with no word"]
        return None, lines[-1].replace(str(deck), deck.name)
    nothing = {kind: [] for kind in KINDS}
    if not (out / "displacements.csv").exists():
        return nothing | {"displacements": [of_members(deck, out)]}, ""
    tables = dict(nothing)
    for kind in KINDS:
        path, steps, keys = out / f"{kind}.csv", {}, 2 if kind == "stresses" else 1
        if path.exists():
            with open(path) as lines:
                for step, *row in list(csv.reader(lines))[1:]:
                    steps.setdefault(int(step), {})[tuple(map(int, row[:keys]))] = [float(w) for w in row[keys:]]
        tables[kind] = [steps[k] for k in sorted(steps)]
    # xx, yy, zz, xy, yz, zx as CalculiX writes them: xx, yy, zz, xy, xz, yz.
    for step in tables["stresses"]:
        for key, (xx, yy, zz, xy, yz, zx) in step.items():
            step[key] = [xx, yy, zz, xy, zx, yz]
    return tables, ""


def stiffest(deck):
    """The largest constant of *ELASTIC, of which a stress is a part that is small or is not."""
    most, inside = 0.0, False
    for line in deck.read_text(errors="replace").splitlines():
        if line.startswith("*"):
            inside = keyword(line) == "ELASTIC" if keyword(line) else inside
        elif inside:
            most = max([most, *(float(w) for w in re.findall(r"[-+\d.]+(?:[EeDd][-+]?\d+)?", line.upper().replace("D", "E")))])
    return most


def apart(a, b, least=0.0):
    """The largest difference over the largest value, or nothing where they are not of the same points."""
    keys = a.keys() & b.keys()
    if not keys or len(keys) < len(a):
        return None
    size = max((abs(v) for k in keys for v in a[k]), default=0.0)
    size = max(size, least)
    most = max(abs(x - y) for k in keys for x, y in zip(a[k], b[k]))
    return most / size if size > 0 else most


def aside(a, b):
    """The largest difference of an eigenvalue over itself; those at nothing over the largest."""
    if not a or len(b) < len(a):
        return None
    floor = 1e-8 * max(abs(v[0]) for v in a.values())
    return max(abs(v[0] - b[k][0]) / max(abs(v[0]), floor) for k, v in a.items())


def compared(found, given, stiff):
    """The largest difference of every kind over the steps; none where it cannot be compared."""
    least = {"stresses": NOTHING_STRAINED * stiff}
    worst = {}
    for kind in KINDS:
        a, b = given[kind], found[kind]
        each = [aside(x, y) if kind == "eigenvalues" else apart(x, y, least.get(kind, 0.0)) for x, y in zip(a[-len(b) :], b)]
        whole = len(a) >= len(b) > 0 and None not in each
        worst[kind] = max(each) if whole else None
    return worst


def row(program, peer, deck):
    with tempfile.TemporaryDirectory() as name:
        room = Path(name)
        found, refusal = ours(program, deck, room / "out")
        if found is None:
            return [deck.name, "refused", "", "", "", "", refusal.split(": ", 1)[-1]]
        given, complaint = theirs(peer, deck, room, found)
        if given is None:
            return [deck.name, "read", "", "", "", "", f"CalculiX: {complaint}"]
        worst = compared(found, given, stiffest(deck))
        wanted = [kind for kind in KINDS if found[kind]]
        # Of beams and shells of members stresses are at other points.
        idle = [kind for kind in wanted if kind == "stresses" and worst[kind] is None]
        agrees = all(kind in idle or (worst[kind] is not None and worst[kind] <= AGREES) for kind in wanted)
        missing = [kind for kind in wanted if worst[kind] is None]
        note = f"{', '.join(missing)} not at the same points" if missing else ""
        show = lambda x: "" if x is None else f"{x:.1e}"
        return [deck.name, "agrees" if agrees and wanted != idle else "read", *(show(worst[kind]) for kind in KINDS), note]


def main():
    program, folder, table = os.path.abspath(sys.argv[1]), Path(sys.argv[2]).resolve(), sys.argv[3]
    peer = os.environ.get("CCX", "ccx")
    rows = [row(program, peer, deck) for deck in sorted(folder.glob("*.inp"))]
    with open(table, "w", newline="") as out:
        csv.writer(out).writerows([["deck", "state", *KINDS, "why"], *rows])
    count = lambda *states: sum(r[1] in states for r in rows)
    print(f"{len(rows)} decks: {count('read', 'agrees')} read, {count('agrees')} agree within {AGREES:g}, {count('refused')} refused; {table}")


if __name__ == "__main__":
    main()
