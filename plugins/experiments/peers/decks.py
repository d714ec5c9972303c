"""Decks of others, computed by CalculiX and by us: which are read, and whether both say the same.

    python3 plugins/experiments/peers/decks.py target/release/intrados FOLDER table.csv

FOLDER holds .inp files, such as CalculiX' own (Debian: calculix-ccx-test, unpacked) or those of FreeCAD's tests (src/Mod/Fem/femtest/data/calculix).
`ccx` is looked for in PATH, or named by CCX. What a deck prints is replaced by displacements of all nodes and stresses at all points at the end of every step,
in global axes. A deck agrees where the largest difference over the largest value is at most 1e-4, for displacements and for stresses, in every step. CalculiX
writes seven digits. Where its stresses are at other points than ours (beams, shells) only displacements are compared, and the table says so.
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
PRINTS = ("NODEPRINT", "ELPRINT", "NODEFILE", "ELFILE", "CONTACTFILE", "CONTACTPRINT", "SECTIONPRINT", "FACEPRINT", "NODEOUTPUT", "ELEMENTOUTPUT")
OURS = "*NODE PRINT,NSET=ZZALL,GLOBAL=YES,FREQUENCY=100000\nU\n*EL PRINT,ELSET=ZZALL,GLOBAL=YES,FREQUENCY=100000\nS\n"


def keyword(line):
    return line[1:].split(",")[0].replace(" ", "").upper() if line.startswith("*") and not line.startswith("**") else None


def number(word):
    """Fortran leaves out the E of exponents of three digits."""
    return float(re.sub(r"(?<=\d)([+-]\d{3})$", r"E\1", word))


def named(kind, numbers):
    """A set of these numbers: CalculiX prints what memory holds for elements that a range names and nobody defined."""
    rows = [", ".join(map(str, numbers[i : i + 8])) for i in range(0, len(numbers), 8)]
    return "\n".join([f"*{kind},{kind}=ZZALL", *rows])


def printing(text, nodes, elements):
    """The deck, printing what is compared and nothing else."""
    lines, inside, skip = [], False, False
    ours = OURS if elements else OURS[: OURS.index("*EL")]
    for line in text.splitlines():
        name = keyword(line)
        if name:
            skip = name in PRINTS
            if name == "STEP" and not inside:
                inside = True
                lines.append(named("NSET", nodes))
                if elements:
                    lines.append(named("ELSET", elements))
            if name == "ENDSTEP":
                lines.append(ours.rstrip())
        if not skip:
            lines.append(line)
    return "\n".join(lines) + "\n"


def theirs(program, deck, room, found):
    """Displacements and stresses of every step by CalculiX; what it says where it fails."""
    nodes, elements = (sorted({key[0] for key in steps[0]}) if steps else [] for steps in found)
    (room / "deck.inp").write_text(printing(deck.read_text(errors="replace"), nodes, elements))
    try:
        ran = subprocess.run([program, "-i", "deck"], cwd=room, capture_output=True, text=True, timeout=300, errors="replace")
    except subprocess.TimeoutExpired:
        return None, "longer than five minutes"
    data = room / "deck.dat"
    if ran.returncode or not data.exists():
        complaint = next((line.strip() for line in ran.stdout.splitlines() if "*ERROR" in line), "")
        return None, complaint or f"it ends with {ran.returncode}"
    moved, stressed, into = [], [], None
    for line in data.read_text().splitlines():
        words = line.split()
        if line.strip().startswith("displacements"):
            into = {}
            moved.append(into)
        elif line.strip().startswith("stresses"):
            into = {}
            stressed.append(into)
        elif words and words[0].isdigit() and into is not None:
            keys = 1 if into is moved[-1] else 2
            into[tuple(map(int, words[:keys]))] = [number(w) for w in words[keys : keys + 3 * keys]]
        elif words:
            into = None
    return (moved, stressed), ""


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
    ran = subprocess.run([program, "analyze", deck, "--units", "m,N", "--out", out, "--quiet"], capture_output=True, text=True, timeout=600)
    if ran.returncode not in (0, 4) or not (out / "analyze.json").exists():
        lines = ran.stderr.strip().splitlines() or ["it ends with no word"]
        return None, lines[-1].replace(str(deck), deck.name)
    if not (out / "displacements.csv").exists():
        return ([of_members(deck, out)], []), ""
    tables = []
    for name, keys in [("displacements.csv", 1), ("stresses.csv", 2)]:
        steps = []
        with open(out / name) as lines:
            for step, *row in list(csv.reader(lines))[1:]:
                while len(steps) < int(step):
                    steps.append({})
                steps[-1][tuple(map(int, row[:keys]))] = [float(w) for w in row[keys:]]
        tables.append(steps)
    # xx, yy, zz, xy, yz, zx as CalculiX writes them: xx, yy, zz, xy, xz, yz.
    for step in tables[1]:
        for key, (xx, yy, zz, xy, yz, zx) in step.items():
            step[key] = [xx, yy, zz, xy, zx, yz]
    return tuple(tables), ""


def apart(a, b):
    """The largest difference over the largest value, or nothing where they are not of the same points."""
    keys = a.keys() & b.keys()
    if not keys or len(keys) < len(a):
        return None
    size = max((abs(v) for k in keys for v in a[k]), default=0.0)
    most = max(abs(x - y) for k in keys for x, y in zip(a[k], b[k]))
    return most / size if size > 0 else most


def compared(found, given):
    """Largest differences of displacements and of stresses over the steps."""
    worst = []
    for a, b in zip(given, found):
        pairs = list(zip(a[-len(b) :], b))
        all_steps = [apart(x, y) for x, y in pairs]
        worst.append(max(all_steps) if all_steps and None not in all_steps else None)
    return worst


def row(program, peer, deck):
    with tempfile.TemporaryDirectory() as name:
        room = Path(name)
        found, refusal = ours(program, deck, room / "out")
        if found is None:
            return [deck.name, "refused", "", "", refusal.split(": ", 1)[-1]]
        given, complaint = theirs(peer, deck, room, found)
        if given is None:
            return [deck.name, "read", "", "", f"CalculiX: {complaint}"]
        moved, stressed = compared(found, given)
        agrees = moved is not None and moved <= AGREES and (stressed is None or stressed <= AGREES)
        note = "" if stressed is not None else "stresses not at the same points"
        show = lambda x: "" if x is None else f"{x:.1e}"
        return [deck.name, "agrees" if agrees else "read", show(moved), show(stressed), note]


def main():
    program, folder, table = os.path.abspath(sys.argv[1]), Path(sys.argv[2]).resolve(), sys.argv[3]
    peer = os.environ.get("CCX", "ccx")
    rows = [row(program, peer, deck) for deck in sorted(folder.glob("*.inp"))]
    with open(table, "w", newline="") as out:
        csv.writer(out).writerows([["deck", "state", "displacements", "stresses", "why"], *rows])
    count = lambda *states: sum(r[1] in states for r in rows)
    print(f"{len(rows)} decks: {count('read', 'agrees')} read, {count('agrees')} agree within {AGREES:g}, {count('refused')} refused; {table}")


if __name__ == "__main__":
    main()
