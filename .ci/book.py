#!/usr/bin/env python3
"""The book holds: every page is in its table of contents, every link, picture and included file is there, and every command in a block of code is one that the program has,
with options that it knows. Links of included pages are judged from where those pages lie. `.ci/book.py [PROGRAM]`; mdBook itself is run where it is installed."""
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
SOURCE = ROOT / "docs/book/src"
PROGRAM = Path(sys.argv[1] if len(sys.argv) > 1 else ROOT / "target/release/intrados")
faults = []


def text_of(page):
    """A page without blocks of code, and those blocks with their language."""
    text = page.read_text()
    blocks = re.findall(r"^```(\S*)\n(.*?)^```", text, re.S | re.M)
    return re.sub(r"^```.*?^```", "", text, flags=re.S | re.M), blocks


def lead_somewhere(page, name):
    for link in re.findall(r"\]\(([^)\s]+)\)", text_of(page)[0]):
        target = link.split("#")[0]
        if target and ":" not in target and not (page.parent / target).exists():
            faults.append(f"{name}: {link} leads nowhere")


def included(page):
    for path, first, last in re.findall(r"\{\{#include ([^}:]+)(?::(\d+):(\d+))?\}\}", page.read_text()):
        other = (page.parent / path).resolve()
        if not other.is_file():
            faults.append(f"{page.name}: {path} is not there to be included")
            continue
        if last and len(other.read_text().splitlines()) < int(last):
            faults.append(f"{page.name}: {path} has no line {last}")
        lead_somewhere(other, f"{page.name} (from {path})")


known = {}


def help_of(command):
    if command not in known:
        ran = subprocess.run([PROGRAM, *command, "--help"], capture_output=True, text=True)
        known[command] = ran.stdout if ran.returncode == 0 else None
    return known[command]


def command_holds(page, line):
    words = line.split("#")[0].split()
    if not words or words[0] not in ("intrados", "target/release/intrados"):
        return
    sub = tuple(w for w in words[1:2] if not w.startswith("-"))
    if sub == ("campaign",):
        sub = ("campaign", *words[2:3])
    page_of_help = help_of(sub)
    if page_of_help is None:
        faults.append(f"{page.name}: `{line}`: there is no such command")
        return
    for option in re.findall(r"(?<=\s)--[a-z][a-z-]*", line.split("#")[0]):
        if not re.search(rf"{option}\b(?!-)", page_of_help):
            faults.append(f"{page.name}: `{line}`: {' '.join(sub)} has no {option}")


def commands(page):
    text, blocks = text_of(page)
    for language, block in blocks:
        if language in ("sh", "console"):
            for line in block.replace("\\\n", " ").splitlines():
                command_holds(page, line.removeprefix("$ ").strip())
        elif language == "python":
            try:
                compile(block, page.name, "exec")
            except SyntaxError as why:
                faults.append(f"{page.name}: {why}")
    for line in re.findall(r"`((?:INTRADOS_DATA=… )?intrados [^`]+)`", text):
        command_holds(page, line.removeprefix("INTRADOS_DATA=… "))


if not PROGRAM.exists():
    sys.exit(f"{PROGRAM} is not there: build it, or name it")
listed = set(re.findall(r"\]\(([^)]+\.md)\)", (SOURCE / "SUMMARY.md").read_text()))
pages = {p.name for p in SOURCE.glob("*.md")} - {"SUMMARY.md"}
faults += [f"SUMMARY.md: {name} is not there" for name in sorted(listed - pages)]
faults += [f"SUMMARY.md: {name} is not listed" for name in sorted(pages - listed)]
for page in sorted(SOURCE.glob("*.md")):
    lead_somewhere(page, page.name)
    included(page)
    commands(page)
if shutil.which("mdbook") and not faults:
    with tempfile.TemporaryDirectory() as out:
        subprocess.run(["mdbook", "build", "--dest-dir", out, SOURCE.parent], check=True)
        # A block of code without a language counts as Rust.
        subprocess.run(["mdbook", "test", SOURCE.parent], check=True)
print("\n".join(faults) or f"{len(pages)} pages of the book hold" + ("" if shutil.which("mdbook") else "; mdBook is not installed and was not run"))
sys.exit(bool(faults))
