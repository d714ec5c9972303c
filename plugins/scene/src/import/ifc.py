"""Reads an IFC file with IfcOpenShell: python3 ifc.py MODEL.ifc FOLDER

Writes FOLDER/elements.json (what the file says of every element) and FOLDER/shapes.bin (corners as
three doubles, m, z up; triangles as three 32-bit numbers; little-endian). Lines on standard output
are JSON: {"done", "total", "what"} now and then, at the end {"ready": true} or {"fault", "message"}.
What is a member, and of what, is decided by who reads this, not here.
"""

import array
import json
import os
import re
import sys

OLDEST = (0, 8)
# Products that are no bodies: rooms, holes, lines, and what an analysis model is made of.
NO_BODIES = (
    "IfcFeatureElementSubtraction", "IfcSpatialElement", "IfcSpatialStructureElement",
    "IfcAnnotation", "IfcGrid", "IfcPort", "IfcVirtualElement", "IfcPositioningElement",
    "IfcStructuralActivity", "IfcStructuralItem", "IfcLinearElement",
)
# Spatial elements that may be drawn themselves: parts of bridges and tunnels.
PARTS = ("IfcFacilityPart", "IfcBridgePart", "IfcTunnelPart")
STEEL = ("IfcReinforcingElement",)


def say(**words):
    print(json.dumps(words, default=str), flush=True)


def fault(code, message=""):
    say(fault=code, message=" ".join(str(message).split())[:400])
    sys.exit(0)


try:
    import ifcopenshell
except ImportError as error:
    fault("absent", error)
version = tuple(int(n) for n in re.findall(r"\d+", ifcopenshell.version)[:2])
if version < OLDEST:
    fault("old", ifcopenshell.version)
try:
    import ifcopenshell.geom as geom
    import ifcopenshell.util.element as about
    import ifcopenshell.util.placement as placement
    import numpy
except ImportError as error:
    fault("absent", error)


def opened(path):
    """The file; drafts of schemas that were never released are read as the last released one."""
    try:
        return ifcopenshell.open(path), None
    except ifcopenshell.SchemaError as error:
        with open(path, encoding="latin-1") as file:
            text = file.read()
        schema = re.compile(r"FILE_SCHEMA\s*\(\s*\(\s*'([^']*)'", re.IGNORECASE)
        own = schema.search(text)
        if not own or not own.group(1).upper().startswith("IFC4"):
            fault("schema", error)
        text = text[: own.start(1)] + "IFC4X3_ADD2" + text[own.end(1):]
        return ifcopenshell.file.from_string(text), own.group(1)


def of_class(element, names):
    for name in names:
        try:
            if element.is_a(name):
                return True
        except RuntimeError:  # A class that this schema does not have.
            pass
    return False


def instances(model, name):
    try:
        return list(model.by_type(name))
    except RuntimeError:
        return []


def plain(value):
    """A property's value as JSON takes it; none of lists and references."""
    if isinstance(value, (bool, int, float, str)):
        return value
    if isinstance(value, (list, tuple)) and value:
        return plain(value[0])
    return None


def properties(thing):
    """All sets of a thing and of its type: {set: {property: value}}."""
    try:
        sets = about.get_psets(thing)
    except Exception:  # A set that is damaged says nothing.
        return {}
    told = {}
    for name, values in sets.items():
        kept = {k: plain(v) for k, v in values.items() if k != "id" and plain(v) is not None}
        if kept:
            told[name] = kept
    return told


def materials(element):
    """Names, categories and property sets of what it is made of, layers and profiles one by one."""
    told = []
    try:
        found = about.get_materials(element)
    except Exception:
        found = []
    for material in found or []:
        told.append({
            "name": getattr(material, "Name", None) or "",
            "category": getattr(material, "Category", None) or "",
            "properties": properties(material) or matter.get(material.id(), {}),
        })
    return told


matter = {}  # By material, in files of IFC2X3, whose materials do not know their properties.


def learn_matter(model):
    for kept in instances(model, "IfcMaterialProperties") if model.schema == "IFC2X3" else ():
        sets = matter.setdefault(kept.Material.id(), {})
        own = sets.setdefault(getattr(kept, "Name", None) or kept.is_a(), {})
        for name, value in kept.get_info(recursive=False).items():
            if isinstance(value, (int, float)) and name != "id":
                own[name] = value
        for p in getattr(kept, "ExtendedProperties", None) or ():
            value = getattr(getattr(p, "NominalValue", None), "wrappedValue", None)
            if plain(value) is not None:
                own[p.Name] = plain(value)


def above(element):
    """Class and name of what it is part of, the nearest first."""
    told, here = [], element
    for _ in range(20):
        try:
            here = about.get_aggregate(here) or about.get_container(here)
        except Exception:
            here = None
        if here is None:
            break
        told.append({"class": here.is_a(), "name": here.Name or "", "id": here.GlobalId})
    return told


ATTRIBUTES = (
    "NominalDiameter", "CrossSectionArea", "BarLength", "SteelGrade", "TensionForce", "PreStress",
    "FrictionCoefficient", "AnchorageSlip", "BarSurface", "BarRole", "SheathDiameter",
)


LENGTHS = ("NominalDiameter", "BarLength", "AnchorageSlip", "SheathDiameter")


def attributes(element, scale, area):
    """What bars and tendons, or their types, say as attributes of the class, in m and m²."""
    told = {}
    for thing in (about.get_type(element), element):
        for name in ATTRIBUTES if thing is not None else ():
            value = plain(getattr(thing, name, None))
            if value is not None:
                in_metres = scale if name in LENGTHS else area if name == "CrossSectionArea" else None
                told[name] = value * in_metres if in_metres else value
    return told


def said(element, scale, area):
    kind = about.get_type(element)
    return {
        "step": element.id(),
        "id": element.GlobalId,
        "class": element.is_a(),
        "name": element.Name or "",
        "object_type": getattr(element, "ObjectType", None) or "",
        "predefined": about.get_predefined_type(element) or "",
        "type": (kind.Name or "") if kind is not None else "",
        "above": above(element),
        "properties": properties(element),
        "materials": materials(element),
        "attributes": attributes(element, scale, area),
        "courses": [],
        "shapes": [],
    }


def length_units(model):
    """Names of the project's units of length, how many metres the first one is, and how many
    square metres its unit of area."""
    names, scale, area = [], None, None
    for project in instances(model, "IfcProject"):
        units = getattr(project, "UnitsInContext", None)
        for unit in units.Units if units else ():
            kind = getattr(unit, "UnitType", None)
            if kind == "LENGTHUNIT":
                prefix = getattr(unit, "Prefix", None) or ""
                names.append(f"{prefix} {unit.Name}".strip().lower())
                scale = scale or metres(unit)
            elif kind == "AREAUNIT" and area is None:
                # The prefix of a square metre is that of the metre, squared.
                area = metres(unit) if unit.is_a("IfcConversionBasedUnit") else metres(unit) ** 2
    return names, scale, area or (scale or 1.0) ** 2


PREFIX = {"KILO": 1e3, "HECTO": 1e2, "DECA": 1e1, "DECI": 1e-1, "CENTI": 1e-2, "MILLI": 1e-3, "MICRO": 1e-6}


def metres(unit):
    if unit.is_a("IfcConversionBasedUnit"):
        factor = unit.ConversionFactor
        own = metres(factor.UnitComponent)
        own = own**2 if unit.UnitType == "AREAUNIT" else own
        return float(factor.ValueComponent.wrappedValue) * own
    return PREFIX.get(getattr(unit, "Prefix", None), 1.0)


def georeference(model):
    """Where the model's origin lies on earth, as far as the file says it."""
    told = {}
    for conversion in instances(model, "IfcMapConversion")[:1]:
        crs = conversion.TargetCRS
        told["map"] = {
            "crs": (crs.Name or "") if crs else "",
            "eastings": conversion.Eastings, "northings": conversion.Northings,
            "height": conversion.OrthogonalHeight,
            "abscissa": conversion.XAxisAbscissa, "ordinate": conversion.XAxisOrdinate,
            "scale": conversion.Scale,
        }
    for site in instances(model, "IfcSite")[:1]:
        for key, value in (("latitude", site.RefLatitude), ("longitude", site.RefLongitude)):
            if value:
                parts = list(value) + [0, 0, 0, 0]
                told[key] = parts[0] + parts[1] / 60 + (parts[2] + parts[3] * 1e-6) / 3600
        if site.RefElevation is not None:
            told["elevation"] = site.RefElevation
    return told


def year(model):
    """When it was built, from any property of that name."""
    for name in ("IfcBuilding", "IfcFacility", "IfcFacilityPart", "IfcSite", "IfcProject"):
        for thing in instances(model, name):
            for values in properties(thing).values():
                for key, value in values.items():
                    found = re.search(r"\b(1[89]|20)\d\d\b", str(value))
                    if re.search(r"year.?of.?construction|construction.?year|baujahr", key, re.I) and found:
                        return int(found.group())
    return None


def disks(representation, matrix, scale):
    """Swept disks of a representation with their placements; none where there is anything else."""
    found = []
    for item in representation.Items:
        if item.is_a("IfcMappedItem"):
            inner = disks(item.MappingSource.MappedRepresentation,
                          matrix @ placement.get_mappeditem_transformation(item), scale)
            if inner is None:
                return None
            found += inner
        elif item.is_a("IfcSweptDiskSolid") and item.StartParam is None and item.EndParam is None:
            found.append((matrix, item))
        else:
            return None
    return found


def courses(element, settings, scale):
    """Axes of bars with their diameters, m, where the file says them; none where it does not."""
    body = [r for r in (element.Representation.Representations if element.Representation else ())
            if r.RepresentationIdentifier in ("Body", None)]
    told = []
    for representation in body:
        try:
            matrix = placement.get_local_placement(element.ObjectPlacement)
            for matrix, disk in disks(representation, matrix, scale) or ():
                matrix = matrix.copy()
                matrix[:3, 3] *= scale
                curve = geom.create_shape(settings, disk.Directrix)
                points = ordered(numpy.array(curve.verts).reshape(-1, 3), curve.edges)
                points = points @ matrix[:3, :3].T + matrix[:3, 3]
                told.append({"diameter": 2 * disk.Radius * scale, "line": points.tolist()})
        except Exception:  # Its surface says where it runs.
            return []
    return told


def ordered(points, edges):
    """Points of a curve in the order in which its edges lead from one to the next."""
    chain = [edges[0]] if len(edges) else list(range(len(points)))
    for from_, to in zip(edges[0::2], edges[1::2]):
        if chain[-1] != from_:
            raise ValueError("the curve is in pieces")
        chain.append(to)
    return points[chain]


class Shapes:
    """Surfaces on their way to the disk; what several elements share is written once."""

    def __init__(self, path):
        self.file, self.at, self.known = open(path, "wb"), 0, {}

    def add(self, shape):
        geometry = shape.geometry
        if geometry.id not in self.known:
            corners, faces = array.array("d", geometry.verts), array.array("I", geometry.faces)
            if sys.byteorder != "little":
                corners.byteswap(), faces.byteswap()
            place = {"at": self.at, "corners": len(corners) // 3, "triangles": len(faces) // 3}
            self.file.write(corners.tobytes())
            self.file.write(faces.tobytes())
            self.at += corners.itemsize * len(corners) + faces.itemsize * len(faces)
            self.known[geometry.id] = {**place, "colour": colour(geometry)}
        matrix = shape.transformation.matrix
        return {**self.known[geometry.id], "matrix": [float(x) for x in matrix]}


def colour(geometry):
    for material in geometry.materials or ():
        try:
            rgb = [material.diffuse.r(), material.diffuse.g(), material.diffuse.b()]
            if all(0 <= x <= 1 for x in rgb):
                return rgb
        except Exception:
            pass
    return None


def main(path, folder):
    try:
        model, draft = opened(path)
    except Exception as error:
        fault("damaged", error)
    if not model.by_type("IfcProject"):
        fault("damaged", "there is no IfcProject in it")
    units, scale, area = length_units(model)
    if not scale or not scale > 0:
        fault("units")
    bodies = [e for e in model.by_type("IfcProduct")
              if e.Representation and (not of_class(e, NO_BODIES) or of_class(e, PARTS))]
    if not bodies:
        fault("empty")
    told = {
        "schema": model.schema_identifier, "draft": draft, "ifcopenshell": ifcopenshell.version,
        "units": units, "metres_per_unit": scale, "year": year(model),
        "project": model.by_type("IfcProject")[0].Name or "",
        "georeference": georeference(model),
    }
    lines = geom.settings()
    lines.set("dimensionality", ifcopenshell.ifcopenshell_wrapper.CURVES_SURFACES_AND_SOLIDS)
    learn_matter(model)
    elements, surfaces = {}, []
    for i, body in enumerate(bodies):
        if i % 200 == 0:
            say(done=i, total=2 * len(bodies), what="reading properties")
        element = elements[body.id()] = said(body, scale, area)
        if of_class(body, STEEL):
            element["courses"] = courses(body, lines, scale)
        if not element["courses"]:
            surfaces.append(body)
    shapes = Shapes(os.path.join(folder, "shapes.bin"))
    settings = geom.settings()
    settings.set("weld-vertices", True)
    iterator = geom.iterator(settings, model, min(4, os.cpu_count() or 1), include=surfaces) if surfaces else None
    if iterator is not None and iterator.initialize():
        done = 0
        while True:
            shape = iterator.get()
            element = elements.get(shape.id)
            if element is not None:
                element["shapes"].append(shapes.add(shape))
                done += 1
                if done % 20 == 1:
                    say(done=len(bodies) + done, total=2 * len(bodies), what=f"{element['class']} #{element['step']}")
            if not iterator.next():
                break
    shapes.file.close()
    told["elements"] = [elements[step] for step in sorted(elements)]
    with open(os.path.join(folder, "elements.json"), "w", encoding="utf-8") as file:
        json.dump(told, file)
    say(ready=True)


main(sys.argv[1], sys.argv[2])
