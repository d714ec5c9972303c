"""Reads an IFC file with IfcOpenShell: python3 ifc.py MODEL.ifc FOLDER [SECONDS]

SECONDS is how long one element may take (60 where nothing is said): what takes longer, or breaks
IfcOpenShell, is left out with its reason. Shapes are made in processes of their own, so that such
an element costs no other. All of them end with the process that started this one: it holds the
other end of standard input.

Writes FOLDER/elements.json (what the file says of every element) and FOLDER/shapes.bin (corners as
three doubles, m, z up; triangles as three 32-bit numbers; little-endian). Lines on standard output
are JSON: {"done", "total", "what"} now and then, at the end {"ready": true} or {"fault", "message"}.
What is a member, and of what, is decided by who reads this, not here.
"""

import array
import json
import os
import re
import select
import signal
import stat
import sys
import time

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
    import ifcopenshell.guid
    import ifcopenshell.util.element as about
    import ifcopenshell.util.placement as placement
    import numpy
except ImportError as error:
    fault("absent", error)


unswept = {}  # Why solids along alignments could not be made, by their numbers.


def opened(path):
    """The file; drafts of schemas that were never released are read as the last released one, and
    solids along alignments are made here (sweep.py)."""
    draft = None
    try:
        model = ifcopenshell.open(path)
        if not instances(model, "IfcSectionedSolidHorizontal"):
            return model, None
        with open(path, encoding="latin-1") as file:
            text = file.read()
    except ifcopenshell.SchemaError as error:
        with open(path, encoding="latin-1") as file:
            text = file.read()
        schema = re.compile(r"FILE_SCHEMA\s*\(\s*\(\s*'([^']*)'", re.IGNORECASE)
        own = schema.search(text)
        if not own or not own.group(1).upper().startswith("IFC4"):
            fault("schema", error)
        text, draft = text[: own.start(1)] + "IFC4X3_ADD2" + text[own.end(1):], own.group(1)
    is_early = draft is not None and draft.upper() != "IFC4X3"
    text, reasons = swept(text, is_early)
    unswept.update(reasons)
    return ifcopenshell.file.from_string(text), draft


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
    """All sets of a thing and of its type: {set: {property: value}}; what has a dimension as
    {"value", "si", "unit"}."""
    try:
        sets = about.get_psets(thing, verbose=True)
    except Exception:  # A set that is damaged says nothing.
        return {}
    told = {}
    for name, values in sets.items():
        kept = {k: measured(v) for k, v in values.items() if k != "id"}
        kept = {k: v for k, v in kept.items() if v is not None}
        if kept:
            told[name] = kept
    return told


def measured(said):
    """A property of `get_psets(verbose=True)`: plain, or with its value in SI units."""
    if not isinstance(said, dict):
        return plain(said)
    value = plain(said.get("value"))
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return value
    own = None
    try:
        own = getattr(units.model.by_id(said["id"]), "Unit", None)
    except Exception:
        pass
    return units.quantity(value, said.get("value_type") or "", own)


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
                is_strength = "Strength" in name or "Stress" in name
                own[name] = units.quantity(value, "IfcPressureMeasure" if is_strength else "", None)
        for p in getattr(kept, "ExtendedProperties", None) or ():
            nominal = getattr(p, "NominalValue", None)
            value = plain(getattr(nominal, "wrappedValue", None))
            if isinstance(value, (int, float)) and not isinstance(value, bool):
                value = units.quantity(value, nominal.is_a(), getattr(p, "Unit", None))
            if value is not None:
                own[p.Name] = value


def above(element):
    """Class and name of what it is part of, the nearest first."""
    told, here = [], element
    for _ in range(20):
        try:
            here = about.get_aggregate(here) or about.get_nest(here) or about.get_container(here)
        except Exception:
            here = None
        if here is None:
            break
        told.append({"class": here.is_a(), "name": here.Name or "", "id": here.GlobalId or ""})
    return told


# Attributes of bars, meshes and tendons with the dimension of each; "" has none.
ATTRIBUTES = {
    "NominalDiameter": "LENGTHUNIT", "BarLength": "LENGTHUNIT", "AnchorageSlip": "LENGTHUNIT",
    "SheathDiameter": "LENGTHUNIT", "LongitudinalBarNominalDiameter": "LENGTHUNIT",
    "TransverseBarNominalDiameter": "LENGTHUNIT", "CrossSectionArea": "AREAUNIT",
    "TensionForce": "FORCEUNIT", "PreStress": "PRESSUREUNIT", "SteelGrade": "", "BarSurface": "",
    "BarRole": "", "FrictionCoefficient": "",
}


def attributes(element):
    """What bars and tendons, or their types, say as attributes of the class, in m, m², N and Pa;
    under `raw` the numbers as the file has them."""
    told, raw = {}, {}
    for thing in (about.get_type(element), element):
        for name, unit in ATTRIBUTES.items() if thing is not None else ():
            value = plain(getattr(thing, name, None))
            if value is None:
                continue
            told[name] = value * units.factor(unit) if unit else value
            if unit:
                raw[name] = value
    if raw:
        told["raw"] = raw
    return told


def said(element):
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
        "attributes": attributes(element),
        "courses": [],
        "shapes": [],
        "items": "",
        "reason": "",
    }


def said_of(element):
    """The same of any element: what is damaged in it is left out, and a GlobalId that is missing is
    an empty one."""
    try:
        told = said(element)
    except Exception as error:
        told = {
            "step": element.id(), "class": element.is_a(), "name": str(element.Name or ""),
            "object_type": "", "predefined": "", "type": "", "above": above(element),
            "properties": {}, "materials": [], "attributes": {}, "courses": [], "shapes": [],
            "items": "", "reason": "", "id": None,
            "damaged": shortened(error),
        }
    told["id"] = element.GlobalId or ""
    return told


PREFIX = {
    "EXA": 1e18, "PETA": 1e15, "TERA": 1e12, "GIGA": 1e9, "MEGA": 1e6, "KILO": 1e3, "HECTO": 1e2,
    "DECA": 1e1, "DECI": 1e-1, "CENTI": 1e-2, "MILLI": 1e-3, "MICRO": 1e-6, "NANO": 1e-9,
}
POWER = {"SQUARE_METRE": 2, "CUBIC_METRE": 3}


def si(unit):
    """How many of the SI unit of its dimension a unit is; none where nobody can say."""
    if unit is None:
        return None
    if unit.is_a("IfcSIUnit"):
        # The prefix of a square metre is that of the metre, squared; kilograms are the SI unit.
        factor = PREFIX.get(unit.Prefix, 1.0) ** POWER.get(unit.Name, 1)
        return factor * 1e-3 if unit.Name == "GRAM" else factor
    if unit.is_a("IfcConversionBasedUnit"):
        factor = unit.ConversionFactor
        own = si(factor.UnitComponent)
        number = float(factor.ValueComponent.wrappedValue)
        return number * own if own and number > 0 else None
    if unit.is_a("IfcDerivedUnit"):
        product = 1.0
        for part in unit.Elements:
            own = si(part.Unit)
            if own is None:
                return None
            product *= own ** part.Exponent
        return product
    return None


MEASURES = {
    "IfcLengthMeasure": "LENGTHUNIT", "IfcPositiveLengthMeasure": "LENGTHUNIT",
    "IfcNonNegativeLengthMeasure": "LENGTHUNIT", "IfcAreaMeasure": "AREAUNIT",
    "IfcPressureMeasure": "PRESSUREUNIT", "IfcForceMeasure": "FORCEUNIT",
    "IfcModulusOfElasticityMeasure": "MODULUSOFELASTICITYUNIT",
}


class Units:
    """Units of the project: the first one of each dimension."""

    def __init__(self, model, project):
        self.model, self.known, self.lengths = model, {}, []
        assignment = getattr(project, "UnitsInContext", None)
        for unit in assignment.Units if assignment else ():
            kind, factor = getattr(unit, "UnitType", None), None
            try:
                factor = si(unit)
            except Exception:  # A unit that is damaged says nothing.
                pass
            if kind == "LENGTHUNIT" and factor:
                self.lengths.append((label(unit), factor, unit))
            if factor:
                self.known.setdefault(kind, factor)

    def factor(self, dimension):
        """SI units where the project says none; areas by its length."""
        if dimension == "AREAUNIT":
            return self.known.get(dimension) or self.known.get("LENGTHUNIT", 1.0) ** 2
        return self.known.get(dimension) or 1.0

    def quantity(self, value, measure, own):
        dimension, factor = MEASURES.get(measure), None
        if own is not None:
            dimension, factor = getattr(own, "UnitType", None) or dimension, si(own)
        elif dimension:
            factor = self.factor(dimension)
        if not factor or not dimension:
            return value
        return {"value": value, "si": value * factor, "unit": dimension}

    def use(self, model, project, chosen):
        """Leaves one project with one unit of length: of several units IfcOpenShell takes the last
        one, and of several contexts, as of a library beside the project, none."""
        for context in instances(model, "IfcContext" if model.schema != "IFC2X3" else "IfcProject"):
            if context != project:
                model.remove(context)
        others = [unit for _, _, unit in self.lengths if unit != chosen]
        if others:
            kept = project.UnitsInContext
            kept.Units = [u for u in kept.Units if u not in others]


units = None  # Of the project, once it is open.


def label(unit):
    prefix = getattr(unit, "Prefix", None) or ""
    return f"{prefix} {unit.Name}".strip().lower()


def likely_units(model, projects):
    """Units of the first project and the first of its lengths in which what is extruded is as long
    as a member can be; of the first project where none is."""
    depths = sorted(s.Depth for s in instances(model, "IfcExtrudedAreaSolid"))
    told = [(project, Units(model, project)) for project in projects]
    told = [(project, known) for project, known in told if known.lengths]
    if not told:
        fault("units")
    for project, known in told if depths else ():
        for length in known.lengths:
            if 0.05 <= depths[len(depths) // 2] * length[1] <= 100:
                return project, known, length
    return *told[0], told[0][1].lengths[0]


def georeference(model):
    """Where the model's origin lies on earth, as far as the file says it; lengths in m."""
    told = {}
    scale = units.factor("LENGTHUNIT")
    conversion = map_conversion(model)
    if conversion is not None:
        own, crs, unit = conversion
        told["map"] = {
            "crs": crs, "eastings": own.get("Eastings"), "northings": own.get("Northings"),
            "height": own.get("OrthogonalHeight") or 0.0,
            "abscissa": own.get("XAxisAbscissa"), "ordinate": own.get("XAxisOrdinate"),
            "scale": own.get("Scale"), "metres_per_unit": unit,
        }
        if None in (told["map"]["eastings"], told["map"]["northings"]):
            del told["map"]
    for site in instances(model, "IfcSite")[:1]:
        for key, value in (("latitude", site.RefLatitude), ("longitude", site.RefLongitude)):
            if value:
                told[key] = degrees(value)
        if site.RefElevation is not None:
            told["elevation"] = site.RefElevation * scale
    return told


def degrees(parts):
    """Degrees, minutes, seconds and millionths: all of one sign, or the first alone has it."""
    parts = list(parts) + [0, 0, 0, 0]
    size = abs(parts[0]) + abs(parts[1]) / 60 + (abs(parts[2]) + abs(parts[3]) * 1e-6) / 3600
    return -size if any(part < 0 for part in parts[:4]) else size


def map_conversion(model):
    """Values of the map conversion, name of its reference system, metres per unit of the map where
    that has one of its own. In IFC2X3 a property set of the site or the project tells them."""
    conversions = instances(model, "IfcMapConversion")
    conversions.sort(key=lambda c: getattr(c.SourceCRS, "ContextType", None) != "Model")
    for conversion in conversions[:1]:
        crs = conversion.TargetCRS
        unit = getattr(crs, "MapUnit", None)
        return conversion.get_info(recursive=False), (crs.Name or "") if crs else "", si(unit)
    for thing in instances(model, "IfcSite")[:1] + instances(model, "IfcProject")[:1]:
        sets = {name.lower(): values for name, values in properties(thing).items()}
        own = sets.get("epset_mapconversion")
        if own and model.schema == "IFC2X3":
            crs = sets.get("epset_projectedcrs", {})
            unit = {"METRE": 1.0, "METER": 1.0, "MILLIMETRE": 1e-3, "FOOT": 0.3048}.get(str(crs.get("MapUnit", "")).upper())
            own = {k: v["value"] if isinstance(v, dict) else v for k, v in own.items()}
            return own, str(crs.get("Name", "")), unit
    return None


def year(model):
    """When it was built, from any property of that name, and the text that says so."""
    unread = ""
    for name in ("IfcBuilding", "IfcFacility", "IfcFacilityPart", "IfcSite", "IfcProject"):
        for thing in instances(model, name):
            for values in properties(thing).values():
                for key, value in values.items():
                    if not re.search(r"year.?of.?construction|construction.?year|baujahr", key, re.I):
                        continue
                    found = re.search(r"\b(1[89]|20)\d\d\b", str(value))
                    if found:
                        return int(found.group()), str(value)
                    unread = unread or str(value).strip()
    return None, unread


def disks(representation, matrix):
    """Swept disks of a representation with their placements; none where there is anything else."""
    found = []
    for item in representation.Items:
        if item.is_a("IfcMappedItem"):
            inner = disks(item.MappingSource.MappedRepresentation,
                          matrix @ placement.get_mappeditem_transformation(item))
            if inner is None:
                return None
            found += inner
        elif item.is_a("IfcSweptDiskSolid"):
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
            for matrix, disk in disks(representation, matrix) or ():
                matrix = matrix.copy()
                matrix[:3, 3] *= scale
                curve = geom.create_shape(settings, disk.Directrix)
                points = ordered(numpy.array(curve.verts).reshape(-1, 3), curve.edges)
                points, is_cut = trimmed(disk, points)
                points = points @ matrix[:3, :3].T + matrix[:3, 3]
                # What is mapped to half its size is half as thick.
                size = abs(numpy.linalg.det(matrix[:3, :3])) ** (1 / 3)
                told.append({"diameter": 2 * disk.Radius * scale * size, "line": points.tolist(),
                             "is_cut": is_cut})
        except Exception:  # Its surface says where it runs.
            return []
    return told


def trimmed(disk, points):
    """What StartParam and EndParam leave of a disk's axis, and whether that is less than all. A
    polyline counts its pieces; other curves are taken whole, as authoring tools mean them."""
    start, end = disk.StartParam, disk.EndParam
    if not disk.Directrix.is_a("IfcPolyline"):
        return points, False
    last = len(points) - 1
    start = 0.0 if start is None else max(0.0, start)
    end = float(last) if end is None else min(float(last), end)
    if start >= end or (start == 0.0 and end == last):
        return points, False

    def at(parameter):
        below = min(int(parameter), last - 1)
        share = parameter - below
        return points[below] * (1 - share) + points[below + 1] * share

    inner = [points[i] for i in range(last + 1) if start < i < end]
    return numpy.array([at(start), *inner, at(end)]), True


def ordered(points, edges):
    """Points of a curve in the order in which its edges lead from one to the next."""
    chain = [edges[0]] if len(edges) else list(range(len(points)))
    for from_, to in zip(edges[0::2], edges[1::2]):
        if chain[-1] != from_:
            raise ValueError("the curve is in pieces")
        chain.append(to)
    return points[chain]


# Representations that are never the body, by identifier and by type.
NO_BODY = ("axis", "box", "footprint", "profile", "clearance", "reference", "cog", "annotation",
           "lighting", "plan", "surveypoints")
NO_SOLID = ("boundingbox", "curve2d", "curve3d", "curve", "point", "pointcloud", "geometricset",
            "geometriccurveset", "annotation2d", "fillarea", "text", "lightsource", "segment")
# The others, the best first: what says nothing of itself is taken for a body.
BODIES = ("body", "facetation", "tessellation", "body-fallback", "mesh", "", None, "surface")


def is_model(representation):
    """Whether it is part of the model in three dimensions, and no plan."""
    context = representation.ContextOfItems
    kind = (getattr(context, "ContextType", None) or "Model").lower()
    view = getattr(context, "TargetView", None)
    return kind != "plan" and view not in ("PLAN_VIEW", "REFLECTED_PLAN_VIEW", "SECTION_VIEW", "ELEVATION_VIEW")


def rank(representation):
    """How good a body it is, the least the best; none where it is none."""
    name = representation.RepresentationIdentifier
    if not name:  # Its context may say what it leaves open.
        name = getattr(representation.ContextOfItems, "ContextIdentifier", None) or ""
    name = name.strip().lower()
    kind = (representation.RepresentationType or "").strip().lower()
    if name in NO_BODY or kind in NO_SOLID or not representation.Items:
        return None
    at = BODIES.index(name if name in BODIES else None)
    view = getattr(representation.ContextOfItems, "TargetView", None)
    return (not is_model(representation), at, view not in (None, "MODEL_VIEW", "NOTDEFINED"))


def keep_bodies(element):
    """Leaves an element its body alone, in memory: several of the same name stay, and who reads
    this decides by where they lie. Why it has none, or an empty text."""
    shape = element.Representation
    ranked = [(rank(r), r) for r in shape.Representations]
    best = min((order for order, _ in ranked if order is not None), default=None)
    if best is None:
        kinds = ", ".join(sorted({r.RepresentationIdentifier or r.RepresentationType or "?" for r in shape.Representations}))
        return f"has no body, only {kinds}" if kinds else "has an empty shape"
    kept = [r for order, r in ranked if order == best]
    if len(kept) < len(ranked):
        shape.Representations = kept
    return ""


def what_it_is(element):
    """Types of the items of its body, for people: IfcSectionedSolidHorizontal."""
    found = []
    for representation in element.Representation.Representations:
        for item in representation.Items:
            if item.is_a("IfcMappedItem"):
                found += [i.is_a() for i in item.MappingSource.MappedRepresentation.Items]
            else:
                found.append(item.is_a())
    return ", ".join(sorted(set(found))[:3])


def own_reason(element):
    """Why a solid of it that runs along an alignment could not be made; empty where none does."""
    items = [i for r in element.Representation.Representations for i in r.Items]
    maps = [i.MappingSource.MappedRepresentation.Items for i in items if i.is_a("IfcMappedItem")]
    found = [unswept[i.id()] for i in items + [i for own in maps for i in own] if i.id() in unswept]
    return found[0] if found else ""


class Shapes:
    """Surfaces on their way to the disk; what several elements share is written once."""

    def __init__(self, path, at):
        self.file, self.at, self.known = open(path, "ab"), at, {}

    def add(self, shape):
        geometry = shape.geometry
        if geometry.id not in self.known:
            corners, faces = array.array("d", geometry.verts), array.array("I", geometry.faces)
            if sys.byteorder != "little":
                corners.byteswap(), faces.byteswap()
            place = {"at": self.at, "corners": len(corners) // 3, "triangles": len(faces) // 3}
            self.file.write(corners.tobytes())
            self.file.write(faces.tobytes())
            self.file.flush()
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


def make_shapes(model, batch, path, at, tell):
    """Shapes of some elements to the file at `path`, from its byte `at` on; `tell` hears of each
    element that is begun or done. What a process of its own does."""
    shapes = Shapes(path, at)
    settings = geom.settings()
    settings.set("weld-vertices", True)
    if len(batch) > 1:
        left = {body.id() for body in batch}
        threads = min(4, os.cpu_count() or 1)
        iterator = geom.iterator(settings, model, threads, include=batch)
        if iterator.initialize():
            while True:
                shape = iterator.get()
                tell(step=shape.id, shape=shapes.add(shape))
                left.discard(shape.id)
                if not iterator.next():
                    break
        batch = [body for body in batch if body.id() in left]
    for body in batch:
        tell(begun=body.id())
        try:
            for representation in body.Representation.Representations:
                tell(step=body.id(), shape=shapes.add(geom.create_shape(settings, body, representation)))
        except Exception as error:
            tell(step=body.id(), reason=f"IfcOpenShell cannot make its shape ({shortened(error)})")
    shapes.file.close()


def shortened(error):
    """What went wrong, without the name of the element, which is said beside it."""
    text = " ".join(str(error).split()).split(" Product: ")[0].rstrip(". ,")
    return (text or type(error).__name__)[:120]


def bound_to_parent():
    """Ends this process with the one that started it, where the system can."""
    try:
        import ctypes
        ctypes.CDLL(None).prctl(1, signal.SIGKILL)  # PR_SET_PDEATHSIG of Linux.
    except Exception:
        pass


def is_orphan():
    """Whether who started this has gone: standard input is a pipe from there, and nothing comes."""
    try:
        is_pipe = stat.S_ISFIFO(os.fstat(0).st_mode)
        return is_pipe and bool(select.select([0], [], [], 0)[0]) and not os.read(0, 1)
    except (OSError, ValueError):
        return False


# What has hardly worked for so long, s, waits for ever.
IDLE = 15.0


class Isolated:
    """A process that makes shapes, and the pipe on which it tells of them."""

    def __init__(self, model, batch, path, at):
        back, out = os.pipe()
        self.pid = os.fork()
        if self.pid == 0:
            bound_to_parent()
            os.close(back)
            os.dup2(2, 1)  # IfcOpenShell prints what it builds.
            with os.fdopen(out, "w") as pipe:
                make_shapes(model, batch, path, at, lambda **words: print(json.dumps(words), file=pipe, flush=True))
            os._exit(0)
        os.close(out)
        self.back, self.rest, self.begin = back, b"", time.monotonic()
        self.worked, self.moved, self.stuck = -1.0, self.begin, False

    def work(self):
        """How long it has worked, s: on a busy machine a clock would blame the innocent. The clock,
        where the system does not say it."""
        now = time.monotonic()
        try:
            with open(f"/proc/{self.pid}/stat", encoding="latin-1") as file:
                numbers = file.read().rsplit(")", 1)[1].split()
            work = (int(numbers[11]) + int(numbers[12])) / os.sysconf("SC_CLK_TCK")
        except (OSError, ValueError, IndexError):
            return now - self.begin
        if self.worked < 0 or now - self.moved > IDLE:
            # A hundredth of the time is what waiting itself takes.
            self.stuck = self.worked >= 0 and work - self.worked < 0.01 * (now - self.moved)
            self.worked, self.moved = work, now
        return work

    def lines(self, seconds):
        """What it tells within so many seconds; none when it has ended."""
        if not select.select([self.back], [], [], seconds)[0]:
            return []
        read = os.read(self.back, 1 << 16)
        if not read:
            return None
        *lines, self.rest = (self.rest + read).split(b"\n")
        return [json.loads(line) for line in lines]

    def end(self):
        """Whether it ended well."""
        try:
            os.kill(self.pid, signal.SIGKILL)
        except ProcessLookupError:
            pass
        os.close(self.back)
        return os.waitpid(self.pid, 0)[1] == 0


def shapes_of(model, bodies, path, most, hear, progress):
    """All shapes. A process that breaks or says nothing in `most` seconds of work is replaced: what it
    left is tried in ever smaller parts, until the element is alone that is to blame."""
    open(path, "wb").close()
    if not hasattr(os, "fork"):  # All in this process: a bad element costs the others here.
        def tell(**words):
            if "step" in words:
                hear(words)
            progress()
        make_shapes(model, bodies, path, 0, tell)
        return
    queue, blamed = [bodies] if bodies else [], 0
    while queue:
        batch = queue.pop(0)
        limit = max(5.0 if most > 5 else most, most / (1 + blamed))
        at = os.path.getsize(path)
        left = {body.id(): body for body in batch}
        # Of a batch several are made at a time.
        most_work = limit * (min(4, os.cpu_count() or 1) if len(batch) > 1 else 1)
        process, heard, is_late, ended = Isolated(model, batch, path, at), 0.0, False, False
        try:
            while not is_late and not ended:
                lines = process.lines(0.2)
                if lines:
                    heard = process.work()
                for words in lines or ():
                    if "step" in words:
                        left.pop(words["step"], None)
                        hear(words)
                ended = lines is None
                is_late = not ended and (process.work() - heard > most_work or process.stuck)
                progress()
        finally:
            is_well = process.end() or ended and not left
        if is_well or not left:
            continue
        rest = list(left.values())
        if len(batch) == 1:
            blamed += 1
            slow = "stops IfcOpenShell" if process.stuck else f"takes IfcOpenShell longer than {limit:.0f} s"
            why = slow if is_late else "breaks IfcOpenShell"
            hear({"step": rest[0].id(), "reason": why})
        else:
            size = max(1, len(rest) // 8)
            queue[:0] = [rest[i:i + size] for i in range(0, len(rest), size)]


def keep_first_units(model):
    """Leaves one unit of a kind, in memory, the first: IfcOpenShell takes the last."""
    for assignment in instances(model, "IfcUnitAssignment"):
        kinds, kept = set(), []
        for unit in assignment.Units:
            kind = getattr(unit, "UnitType", None)
            if kind is None or kind not in kinds or kind == "USERDEFINED":
                kept.append(unit)
            kinds.add(kind)
        if len(kept) < len(assignment.Units):
            assignment.Units = kept


def main(path, folder, most=60.0):
    bound_to_parent()
    global units
    try:
        model, draft = opened(path)
    except Exception as error:
        fault("damaged", error)
    if not model.by_type("IfcProject"):
        fault("damaged", "there is no IfcProject in it")
    projects = model.by_type("IfcProject")
    titles = [p.Name or "" for p in projects]
    project, units, (chosen, scale, unit) = likely_units(model, projects)
    title = project.Name or ""
    units.known["LENGTHUNIT"] = scale
    units.use(model, project, unit)
    keep_first_units(model)
    bodies = [e for e in model.by_type("IfcProduct")
              if e.Representation and (not of_class(e, NO_BODIES) or of_class(e, PARTS))]
    if not bodies:
        fault("empty")
    told = {
        "schema": model.schema_identifier, "draft": draft, "ifcopenshell": ifcopenshell.version,
        "units": [name for name, _, _ in units.lengths], "unit": chosen, "metres_per_unit": scale,
        "year": year(model)[0], "year_text": year(model)[1],
        "project": title, "projects": titles,
        "steel_without_shape": sum(1 for e in instances(model, "IfcReinforcingElement")
                                   if not e.Representation),
        "georeference": georeference(model),
    }
    lines = geom.settings()
    lines.set("dimensionality", ifcopenshell.ifcopenshell_wrapper.CURVES_SURFACES_AND_SOLIDS)
    learn_matter(model)
    elements, surfaces = {}, []
    for i, body in enumerate(bodies):
        if i % 200 == 0:
            say(done=i, total=2 * len(bodies), what="reading properties")
        if i % 20 == 0 and is_orphan():
            sys.exit(1)
        element = elements[body.id()] = said_of(body)
        element["reason"] = keep_bodies(body)
        if not body.GlobalId:  # Its iterator waits for ever where there is none.
            body.GlobalId = ifcopenshell.guid.new()
        if of_class(body, STEEL):
            element["courses"] = courses(body, lines, scale)
        if not element["courses"] and not element["reason"]:
            surfaces.append(body)
    clock = {"done": 0, "told": 0.0}

    def hear(words):
        element = elements.get(words["step"])
        if element is None:
            return
        if "shape" in words:
            clock["done"] += not element["shapes"]
            element["shapes"].append(words["shape"])
            element["reason"] = ""
        else:
            element["reason"] = words["reason"]
        clock["what"] = f"{element['class']} #{element['step']}"

    def progress():
        if is_orphan():
            raise SystemExit(1)
        if time.monotonic() - clock["told"] > 0.5:
            clock["told"] = time.monotonic()
            say(done=len(bodies) + clock["done"], total=2 * len(bodies), what=clock.get("what", "making shapes"))

    shapes_of(model, surfaces, os.path.join(folder, "shapes.bin"), most, hear, progress)
    for body in bodies:
        element = elements[body.id()]
        if not element["shapes"] and not element["courses"]:
            element["reason"] = own_reason(body) or element["reason"] or "IfcOpenShell makes no surface of it"
            element["items"] = what_it_is(body)
    told["elements"] = [elements[step] for step in sorted(elements)]
    with open(os.path.join(folder, "elements.json"), "w", encoding="utf-8") as file:
        json.dump(told, file)
    say(ready=True)


main(sys.argv[1], sys.argv[2], *map(float, sys.argv[3:4]))
