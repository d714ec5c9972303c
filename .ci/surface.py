#!/usr/bin/env python3
"""The public surface: every `pub` item of every crate, as the list beside this script has it. `--write` makes the list anew, and the difference in it is read by
whoever reviews the change."""

import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
LIST = ROOT / ".ci" / "surface.txt"
ITEM = re.compile(r"^\s*pub (?:const |async )?(fn|struct|enum|trait|type|mod|const|static) (\w+)", re.M)

lines = []
for folder in sorted([ROOT / "app", ROOT / "assets", ROOT / "scenes", *(ROOT / "plugins").iterdir()]):
    for page in sorted(folder.glob("src/**/*.rs")):
        text = page.read_text().split("\n#[cfg(test)]\nmod tests {")[0]
        place = page.relative_to(ROOT).as_posix()
        lines += sorted(f"{place}: {kind} {name}" for kind, name in ITEM.findall(text))
text = "\n".join(lines) + "\n"
if "--write" in sys.argv:
    LIST.write_text(text)
before, now = set(LIST.read_text().splitlines()), set(lines)
print("\n".join([f"+ {line}" for line in sorted(now - before)] + [f"- {line}" for line in sorted(before - now)]) or f"{len(lines)} public items, as listed")
sys.exit(text != LIST.read_text())
