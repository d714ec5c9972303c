#!/usr/bin/env python3
"""The house holds: a crate depends only on those before it in ARCHITECTURE's table, rooms of a crate need each other in no circle that is not named, every
dependency is used and built once, and every link of a page leads somewhere."""

import pathlib
import re
import subprocess
import sys
import tomllib

ROOT = pathlib.Path(__file__).resolve().parent.parent
BESIDE = [{"light", "xray", "mechanics"}]
# Rooms of one crate that need each other, and why they may; ARCHITECTURE says the same.
CIRCLES = {
    "light": [{"battery", "bsdf", "emit"}, {"field", "link", "lit", "problem", "reach", "sensor"}],
    "mechanics": [{"element", "mesh"}],
    "panels": [
        {"picture", "refine", "statistics", "viewpoint"},
        {"action", "album", "attach", "banner", "border", "command", "create", "ct", "dialog", "drops", "edits", "export", "layout", "light_line", "line", "members", "photos", "report", "saving", "session", "sheet", "start", "stress", "structure", "trail", "views"},
    ],
    "scene": [{"file", "load", "parametric"}, {"member", "scene", "structure"}],
}
faults = []


# Crates that lie beside `plugins/`.
BESIDE_PLUGINS = ("app", "assets", "scenes", "tests")


def table():
    """Names of our crates in the order of ARCHITECTURE's table."""
    rows = re.findall(r"^\| `(?:plugins/)?(\w[\w/-]*)` \|", (ROOT / "ARCHITECTURE.md").read_text(), re.M)
    return [row for row in rows if (ROOT / "plugins" / row / "Cargo.toml").exists() or row in BESIDE_PLUGINS]


def folder(crate):
    return ROOT / crate if crate in BESIDE_PLUGINS else ROOT / "plugins" / crate


def name(crate):
    return "intrados" if crate == "app" else f"intrados-{crate}"


def sources(crate, kinds):
    return "\n".join(p.read_text() for kind in kinds for p in (folder(crate) / kind).rglob("*.rs"))


def dependencies(manifest, kind):
    own = list(manifest.get(kind, {}))
    return own + [d for target in manifest.get("target", {}).values() for d in target.get(kind, {})]


def is_published(crate):
    return "publish" not in tomllib.loads((folder(crate) / "Cargo.toml").read_text())["package"]


order = table()
known = {p.parent.name for p in (ROOT / "plugins").glob("*/Cargo.toml")}
faults += [f"ARCHITECTURE.md: plugins/{crate} is not in the table of crates" for crate in sorted(known - set(order))]
for place, crate in enumerate(order):
    manifest = tomllib.loads((folder(crate) / "Cargo.toml").read_text())
    before = {name(c) for c in order[:place]}
    for dependency in dependencies(manifest, "dependencies"):
        if dependency.startswith("intrados") and dependency not in before:
            faults.append(f"{crate}/Cargo.toml: {dependency} does not stand before {crate} in ARCHITECTURE.md")
        if is_published(crate) and dependency.startswith("intrados") and not is_published(dependency.removeprefix("intrados-")):
            faults.append(f"{crate}/Cargo.toml: {dependency} is not published, and {crate} is")
        for side in BESIDE:
            if crate in side and dependency in {name(c) for c in side}:
                faults.append(f"{crate}/Cargo.toml: {dependency} stands beside {crate}, and neither may import the other")
    for kind, kinds in [("dependencies", ["src"]), ("dev-dependencies", ["src", "tests", "examples", "benches"])]:
        text = sources(crate, kinds)
        for dependency in dependencies(manifest, kind):
            if not re.search(rf"\b{dependency.replace('-', '_')}\b", text):
                faults.append(f"{crate}/Cargo.toml: {dependency} is used nowhere: take it out")

for crate in order:
    for page in folder(crate).rglob("*.rs"):
        if crate != "scene" and re.search(r"intrados_scene::(file\b|\{[^;]*\bfile\b)", page.read_text()):
            faults.append(f"{page.relative_to(ROOT)}: the scene's file is seen by `scene` alone: work on scene::Structure")


def top(text):
    """What stands before the first comma of each entry of a braced list."""
    depth, entry = 0, ""
    for char in text + ",":
        depth += (char == "{") - (char == "}")
        if char == "," and depth == 0:
            yield from re.findall(r"^\s*(\w+)", entry)
            entry = ""
        else:
            entry += char


def uses(crate):
    """Which of its own modules each module of a crate names, tests apart."""
    src = folder(crate) / "src"
    rooms = {p.stem for p in src.iterdir() if p.is_dir() or p.suffix == ".rs"} - {"lib", "main"}
    home = {n: m for m, names in re.findall(r"use (\w+)::(\{.*?\}|\w+)", (src / "lib.rs").read_text(), re.S) for n in re.findall(r"\w+", names)}
    graph = {room: set() for room in rooms}
    for path in src.rglob("*.rs"):
        room = path.relative_to(src).parts[0].removesuffix(".rs")
        text = re.sub(r"^\s*//.*$", "", re.sub(r"#\[cfg\(test\)\]\s*mod tests \{.*", "", path.read_text(), flags=re.S), flags=re.M)
        named = set(re.findall(r"(?<![\w:])crate::(\w+)", text))
        for braces in re.findall(r"use crate::\{(.*?)\};", text, re.S):
            named |= set(top(braces))
        if room in rooms:
            graph[room] |= {n if n in rooms else home.get(n) for n in named} & rooms - {room}
    return graph


def circles(graph):
    """Sets of rooms each of which leads back to itself through the others."""
    def reach(start):
        seen, todo = set(), [start]
        while todo:
            for room in graph[todo.pop()] - seen:
                seen.add(room)
                todo.append(room)
        return seen

    far = {room: reach(room) for room in graph}
    return {frozenset({other for other in far[room] if room in far[other]}) for room in graph if room in far[room]}


for crate in order:
    if (folder(crate) / "src/lib.rs").exists():
        for circle in circles(uses(crate)):
            if circle not in map(frozenset, CIRCLES.get(crate, [])):
                faults.append(f"{crate}: {', '.join(sorted(circle))} need each other in a circle: break it, or name it in .ci/rooms.py and ARCHITECTURE.md")

shared = tomllib.loads((ROOT / "Cargo.toml").read_text())["workspace"]["dependencies"]
manifests = "\n".join(p.read_text() for p in [*ROOT.glob("*/Cargo.toml"), *ROOT.glob("plugins/*/Cargo.toml")])
for dependency in shared:
    if not re.search(rf"^{dependency}(\.workspace| = {{ workspace)", manifests, re.M):
        faults.append(f"Cargo.toml: no crate takes {dependency}: take it out")

for page in [*ROOT.glob("*.md"), *ROOT.glob("docs/*.md"), *ROOT.glob("plugins/*/README.md"), *ROOT.glob("plugins/*/docs/*.md"), *ROOT.glob("assets/*/*.md")]:
    for link in re.findall(r"\]\(([^)\s]+)\)", page.read_text()):
        target = link.split("#")[0]
        if target and ":" not in target and not (page.parent / target).exists():
            faults.append(f"{page.relative_to(ROOT)}: {link} leads nowhere")


def built(kinds, *selection):
    """Each package with its features as a selection of the workspace builds it, our own apart."""
    command = ["cargo", "tree", *selection, "-e", kinds, "--prefix", "none", "-f", "{p} {f}"]
    lines = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout.splitlines()
    return {line.removesuffix(" (*)").replace(" (proc-macro)", "").strip() for line in lines if not line.startswith("intrados")}


# What the program without its window builds, the tests need not build again, and what macros are built with counts too: nine minutes of the gate on two cores.
for line in sorted(built("normal,build", "-p", "intrados", "--no-default-features") - built("normal,build,dev", "--workspace")):
    faults.append(f"{line}: built a second time for the tests, with other features: ask for the same in Cargo.toml, see `stage`")

print("\n".join(faults) or f"{len(order)} crates in order, no dependency unused, no link broken")
sys.exit(bool(faults))
