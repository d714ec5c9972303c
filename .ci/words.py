#!/usr/bin/env python3
"""The words of the code: public type names that stand for several things, names of one word, and words that readers stumble over. Counts may fall, not rise:
`.ci/words.json` holds the present ones, and `--write` renews it. `--list` prints every name and place."""

import collections
import json
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
COUNTS = ROOT / ".ci" / "words.json"
TYPE = re.compile(r"^\s*(pub(?:\([a-z ]+\))? )?(?:struct|enum|trait|union) (\w+)", re.M)
FUNCTION = re.compile(r"^\s*(?:pub(?:\([a-z ]+\))? )?(?:const |async )*fn (\w+)", re.M)
# Archaic verbs and persons who do nothing, in names, comments and messages alike.
STUMBLES = r"behold|beheld|foretell|foretold|unheard|unfelt|whoever|somebody|nobody|hither|thereof|borne|fates?"
STUMBLE = re.compile(rf"(?i)(?<![a-z])(?:{STUMBLES})(?![a-z])")

types, functions, stumbles = collections.defaultdict(list), [], []
for page in sorted([*ROOT.glob("app/src/**/*.rs"), *ROOT.glob("plugins/*/src/**/*.rs")]):
    text = page.read_text().split("\n#[cfg(test)]\nmod tests {")[0]
    place = page.relative_to(ROOT).as_posix()
    for match in TYPE.finditer(text):
        types[match[2]].append((place, bool(match[1]) and match[1] == "pub "))
    functions += FUNCTION.findall(text)
    stumbles += [(place, word.lower()) for word in STUMBLE.findall(text)]


def is_one_word(name):
    return not re.search(r"[a-z0-9][A-Z]|_", name.strip("_"))


definitions = sum(len(places) for places in types.values())
shared = {name: places for name, places in types.items() if len(places) > 1}
public_twice = {name: places for name, places in types.items() if sum(public for _, public in places) > 1}
shares = {
    "types that share their name, %": 100 * sum(map(len, shared.values())) / definitions,
    "types of one word, %": 100 * sum(len(p) for n, p in types.items() if is_one_word(n)) / definitions,
    "functions of one word, %": 100 * sum(map(is_one_word, functions)) / len(functions),
}
now = {"public type names used twice": len(public_twice), "words readers stumble over": len(stumbles)}
now.update({what: round(share, 1) for what, share in shares.items()})
if "--list" in sys.argv:
    for name, places in sorted(public_twice.items()):
        print(name, *(place for place, public in places if public))
    print(*(f"{place}: {word}" for place, word in stumbles), sep="\n")
if "--write" in sys.argv:
    COUNTS.write_text(json.dumps(now, indent=2) + "\n")
before = json.loads(COUNTS.read_text())
for what, count in now.items():
    print(f"{what}: {count} (at most {before[what]})")
sys.exit(any(count > before[what] + 1e-9 for what, count in now.items()))
