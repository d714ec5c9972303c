"""Licences, sources and bans of all crates, as deny.toml has them: `cargo metadata … | python3 .ci/dependencies.py`.

Stands in for `cargo deny` where it is not installed; advisories need that one."""

import json
import re
import sys
import tomllib


def fits(expression: str, allowed: set[str]) -> bool:
    """Whether an SPDX expression can be met with the allowed licences. The old sign for OR is a slash."""
    words = re.findall(r"[()]|[^\s()]+", expression.replace("/", " OR "))

    def either() -> bool:
        value = both()
        while words and words[0] == "OR":
            words.pop(0)
            value = both() or value
        return value

    def both() -> bool:
        value = one()
        while words and words[0] == "AND":
            words.pop(0)
            value = one() and value
        return value

    def one() -> bool:
        word = words.pop(0)
        if word == "(":
            value = either()
            words.pop(0)
            return value
        if words and words[0] == "WITH":
            word = f"{word} WITH {words[1]}"
            del words[:2]
        return word in allowed

    return either() and not words


def main() -> int:
    with open("deny.toml", "rb") as file:
        rules = tomllib.load(file)
    licenses, registries = rules["licenses"], rules["sources"]["allow-registry"]
    exceptions = {e["crate"]: set(e["allow"]) for e in licenses["exceptions"]}
    banned = {b["crate"]: set(b.get("wrappers", [])) for b in rules["bans"]["deny"]}
    faults = []
    packages = json.load(sys.stdin)["packages"]
    for package in packages:
        name = f'{package["name"]} {package["version"]}'
        licence = package["license"] or ""
        if not licence or not fits(licence, set(licenses["allow"]) | exceptions.get(package["name"], set())):
            faults.append(f"{name}: licence {licence or 'not stated'} is not allowed by deny.toml")
        if package["source"] and package["source"].removeprefix("registry+") not in registries:
            faults.append(f'{name}: comes from {package["source"]}')
        for needed in package["dependencies"]:
            # A crate that is let use a banned one is let use it in its tests alone.
            if needed["name"] in banned and (needed["kind"] != "dev" or package["name"] not in banned[needed["name"]]):
                faults.append(f'{name}: {needed["name"]} is banned by deny.toml')
    print("\n".join(faults) or f"{len(packages)} crates: licences, sources and bans hold")
    return 1 if faults else 0


# The reader of expressions, tried where it is used.
for expression, meets in [
    ("MIT", True),
    ("MIT/Apache-2.0", True),
    ("GPL-3.0", False),
    ("GPL-3.0 OR MIT", True),
    ("MIT AND GPL-3.0", False),
    ("(MIT OR GPL-3.0) AND Zlib", True),
    ("(MIT OR Zlib) AND GPL-3.0", False),
    ("Apache-2.0 WITH LLVM-exception OR GPL-3.0", False),
]:
    assert fits(expression, {"MIT", "Zlib", "Apache-2.0"}) == meets, expression

sys.exit(main())
