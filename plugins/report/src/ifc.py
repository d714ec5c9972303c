"""Puts results into an IFC file: python3 ifc.py MODEL.ifc FOLDER

Reads FOLDER/results.json, {GlobalId: {property set: {property: value}}}, and writes FOLDER/model.ifc:
the same model with these property sets on its elements. Sets of ours that were there are replaced.
Lines on standard output are JSON: {"done", "total", "what"}, at the end {"ready": true} or
{"fault", "message"}.
"""

import json
import os
import re
import sys

OLDEST = (0, 8)
# An IfcLabel has at most 255 characters.
TEXTS = ("Advice", "Defects")
LABEL = 255


def say(**words):
    print(json.dumps(words, default=str), flush=True)


def fault(code, message=""):
    say(fault=code, message=" ".join(str(message).split())[:400])
    sys.exit(0)


try:
    import ifcopenshell
except ImportError as error:
    fault("absent", error)
if tuple(int(n) for n in re.findall(r"\d+", ifcopenshell.version)[:2]) < OLDEST:
    fault("old", ifcopenshell.version)
try:
    import ifcopenshell.api.pset as sets
    import ifcopenshell.util.element as about
except ImportError as error:
    fault("absent", error)


def main(path, folder):
    try:
        model = ifcopenshell.open(path)
    except Exception as error:
        fault("unreadable", error)
    with open(os.path.join(folder, "results.json"), encoding="utf-8") as file:
        results = json.load(file)
    known = {}
    for guid in results:
        try:
            known[guid] = model.by_guid(guid)
        except RuntimeError:
            pass
    if not known:
        fault("stranger", f"has none of the {len(results)} members of this scene: give the model that it was imported from")
    for done, (guid, element) in enumerate(known.items()):
        say(done=done, total=len(known), what=guid)
        there = about.get_psets(element, psets_only=True, should_inherit=False)
        for name, properties in results[guid].items():
            old = there.get(name)
            if old:
                sets.remove_pset(model, product=element, pset=model.by_id(old["id"]))
            properties = {
                key: model.create_entity("IfcText", value) if isinstance(value, str) and (key in TEXTS or len(value) > LABEL) else value
                for key, value in properties.items()
            }
            new = sets.add_pset(model, product=element, name=name)
            sets.edit_pset(model, pset=new, properties=properties)
    model.write(os.path.join(folder, "model.ifc"))
    say(ready=True)


if __name__ == "__main__":
    try:
        main(sys.argv[1], sys.argv[2])
    except Exception as error:
        fault("broken", error)
