"""Solids with sections along alignments (IfcSectionedSolidHorizontal), which IfcOpenShell makes with
faces inside them where it makes them at all, and which drafts of the schema (IFC4X1 to IFC4X3 RC4)
write in ways that it does not know: each is swept here and put into the text of the file as a
IfcPolygonalFaceSet. Lines, arcs, clothoids and parabolas; sections stand upright. In front of ifc.py,
which imports numpy.
"""

import math
import re

RECORD = re.compile(r"#(\d+)\s*=\s*(\w+)\s*\(((?:[^';]|'(?:[^']|'')*')*)\)\s*;")
TOKEN = re.compile(r"\s*(?:('(?:[^']|'')*')|#(\d+)|(\.\w+\.)|([-+]?\d+\.?\d*(?:[Ee][-+]?\d+)?)|([A-Za-z_]\w*)|(.))", re.S)
# An arc's chord lies no further from it, m.
CHORD = 0.005
MOST_STATIONS = 5000


class Unswept(Exception):
    """Why a solid cannot be made, for people."""


class Step:
    """Records of a STEP file by their numbers."""

    def __init__(self, text):
        self.text = text
        self.at = {int(m.group(1)): (m.group(2).upper(), m.span(3), m.span()) for m in RECORD.finditer(text)}
        self.known = {}

    def of(self, kind):
        return [number for number, record in self.at.items() if record[0] == kind]

    def get(self, number):
        """Class and arguments: numbers, texts, lists, ("#", number) for what is referred to."""
        if number not in self.known:
            if number not in self.at:
                raise Unswept(f"#{number} is missing")
            name, (begin, end), _ = self.at[number]
            self.known[number] = (name, arguments(self.text[begin:end]))
        return self.known[number]

    def follow(self, value):
        if not isinstance(value, tuple):
            raise Unswept("a reference is missing")
        return self.get(value[1])

    def point(self, value):
        name, (coordinates, *_) = self.follow(value)
        return [float(c) for c in coordinates] + [0.0] * (3 - len(coordinates))


class Typed(list):
    """A list with its type: IFCARCINDEX((1,2,3))."""


def arguments(text):
    stack, here, types = [], [], []
    for quoted, number, word, real, typed, other in TOKEN.findall(text):
        if quoted:
            here.append(quoted[1:-1])
        elif number:
            here.append(("#", int(number)))
        elif word:
            here.append(word)
        elif real:
            here.append(float(real))
        elif typed:
            types.append(typed.upper())
            stack.append("typed")
        elif other == "(":
            stack.append(here)
            here = []
        elif other == ")":
            done, here = here, stack.pop()
            # The value of IFCLENGTHMEASURE(3.) is 3; IFCLINEINDEX((1,2)) keeps its list.
            if stack and stack[-1] == "typed":
                stack.pop()
                value, kind = done[0] if len(done) == 1 else done, types.pop()
                if isinstance(value, list):
                    value = Typed(value)
                    value.kind = kind
                here.append(value)
            else:
                here.append(done)
        elif other in "$*":
            here.append(None)
    return here


class Plan:
    """A curve in plan of pieces whose curvature is linear over their length: lines, arcs, clothoids."""

    def __init__(self):
        self.pieces, self.length = [], 0.0

    def add(self, x, y, heading, length, k0=0.0, k1=None):
        if length > 0:
            self.pieces.append((self.length, length, x, y, heading, k0, k0 if k1 is None else k1))
            self.length += length

    def at(self, s):
        """x, y and heading at a distance; straight on beyond both ends."""
        if not self.pieces:
            raise Unswept("its alignment is empty")
        piece = next((p for p in self.pieces if s <= p[0] + p[1]), self.pieces[-1])
        start, length, x, y, heading, k0, k1 = piece
        d = min(max(s - start, 0.0), length)
        turn = lambda u: heading + k0 * u + (k1 - k0) * u * u / (2 * length)
        if k0 or k1:
            steps = 2 * max(4, int(abs(turn(d) - heading) / 0.05) + 1)
            u = numpy.linspace(0.0, d, steps + 1)
            weights = numpy.ones(steps + 1)
            weights[1:-1:2], weights[2:-1:2] = 4.0, 2.0  # Simpson's.
            angles = turn(u)
            x += d / steps / 3 * float(weights @ numpy.cos(angles))
            y += d / steps / 3 * float(weights @ numpy.sin(angles))
        else:
            x, y = x + d * math.cos(heading), y + d * math.sin(heading)
        end, beyond = turn(d), s - start - d
        return x + beyond * math.cos(end), y + beyond * math.sin(end), end

    def stations(self, scale):
        found = []
        for start, length, *_, k0, k1 in self.pieces:
            k = max(abs(k0), abs(k1))
            # A chord c of a circle lies c² k / 8 from it.
            step = math.sqrt(8 * CHORD / scale / k) if k else length
            count = min(MOST_STATIONS, math.ceil(length / step))
            found += [start + length * i / count for i in range(count + 1)]
        return found


class Profile:
    """Heights along a plan: pieces of (start, length, height, gradient, second derivative, radius)."""

    def __init__(self, pieces=()):
        self.pieces = sorted(pieces)

    def at(self, s):
        if not self.pieces:
            return 0.0
        piece = next((p for p in self.pieces if s <= p[0] + p[1]), self.pieces[-1])
        start, _, height, gradient, bend, radius = piece
        d = s - start
        if not radius:
            return height + gradient * d + bend * d * d / 2
        # Of a circle the sine of the slope is linear.
        slope = math.atan(gradient)
        sine = min(max(math.sin(slope) + d / radius, -1.0), 1.0)
        return height - radius * (math.sqrt(1 - sine * sine) - math.cos(slope))

    def stations(self, scale):
        found = []
        for start, length, _, _, bend, radius in self.pieces:
            k = abs(bend) + (1 / abs(radius) if radius else 0.0)
            step = math.sqrt(8 * CHORD / scale / k) if k else length
            count = min(MOST_STATIONS, max(1, math.ceil(length / max(step, 1e-9))))
            found += [start + length * i / count for i in range(count + 1)]
        return found


class Polyline:
    """Corners of a curve in space; distances run along it."""

    def __init__(self, corners):
        self.corners = numpy.array(corners, float)
        steps = numpy.linalg.norm(numpy.diff(self.corners, axis=0), axis=1)
        self.along = numpy.concatenate([[0.0], numpy.cumsum(steps)])
        self.length = float(self.along[-1])
        if len(corners) < 2 or not self.length > 0:
            raise Unswept("its alignment has no length")

    def at(self, s):
        i = int(min(max(numpy.searchsorted(self.along, s) - 1, 0), len(self.corners) - 2))
        step = self.corners[i + 1] - self.corners[i]
        size = self.along[i + 1] - self.along[i]
        x, y, z = self.corners[i] + step * ((s - self.along[i]) / max(size, 1e-12))
        before = self.corners[i] - self.corners[i - 1] if i and abs(s - self.along[i]) < 1e-9 else step
        after = self.corners[i + 2] - step - self.corners[i] if i + 2 < len(self.corners) and abs(s - self.along[i + 1]) < 1e-9 else step
        # At a corner the section stands in the bisector.
        units = [v[:2] / max(numpy.linalg.norm(v[:2]), 1e-12) for v in (before, step, after)]
        mean = units[0] + units[1] if before is not step else units[1] + units[2]
        return x, y, z, math.atan2(mean[1], mean[0])

    def stations(self, scale):
        return self.along.tolist()


class Alignment:
    """A plan with its heights."""

    def __init__(self, plan, profile):
        self.plan, self.profile, self.length = plan, profile, plan.length

    def at(self, s):
        x, y, heading = self.plan.at(s)
        return x, y, self.profile.at(s), heading

    def stations(self, scale):
        return self.plan.stations(scale) + self.profile.stations(scale)


class Offset:
    """A curve beside another, at offsets that are linear between their stations."""

    def __init__(self, base, offsets):
        self.base, self.offsets, self.length = base, sorted(offsets), base.length

    def at(self, s):
        x, y, z, heading = self.base.at(s)
        along = [o[0] for o in self.offsets]
        left, up = (float(numpy.interp(s, along, [o[i] for o in self.offsets])) for i in (1, 2))
        return x - left * math.sin(heading), y + left * math.cos(heading), z + up, heading

    def stations(self, scale):
        return self.base.stations(scale) + [o[0] for o in self.offsets]


def axis2d(step, value):
    """Place and heading of a placement in a plane."""
    if value is None:
        return 0.0, 0.0, 0.0
    _, (location, *direction) = step.follow(value)
    x, y, _ = step.point(location)
    reference = step.point(direction[0]) if direction and direction[0] else [1.0, 0.0]
    return x, y, math.atan2(reference[1], reference[0])


def curve_segment(step, value):
    """Start, heading, length and curvatures of an IfcCurveSegment."""
    name, args = step.follow(value)
    if name != "IFCCURVESEGMENT":
        raise Unswept(f"its alignment is of {name}")
    _, placement, start, length, parent = args[:5]
    x, y, heading = axis2d(step, placement)
    kind, own = step.follow(parent)
    start, way = float(start or 0.0), math.copysign(1.0, float(length))
    if kind == "IFCLINE":
        k0 = k1 = 0.0
    elif kind == "IFCCIRCLE":
        k0 = k1 = way / float(own[1])
    elif kind == "IFCCLOTHOID":
        constant = float(own[1])
        k0, k1 = ((start + d) * math.copysign(1.0, constant) / constant**2 * way for d in (0.0, float(length)))
    elif kind == "IFCPOLYNOMIALCURVE":
        return x, y, heading, abs(float(length)), 0.0, 0.0, 2 * float((own[2] or [0, 0, 0])[2]) if len(own[2] or []) > 2 else 0.0
    else:
        raise Unswept(f"its alignment has a piece of {kind}")
    return x, y, heading, abs(float(length)), k0, k1, 0.0


def curve(step, value, angle):
    """The directrix."""
    name, args = step.follow(value)
    if name == "IFCPOLYLINE":
        return Polyline([step.point(p) for p in args[0]])
    if name == "IFCINDEXEDPOLYCURVE":
        return Polyline(indexed(step, args))
    if name == "IFCCOMPOSITECURVE":
        return Alignment(plan_of(step, args[0], angle), Profile())
    if name == "IFCGRADIENTCURVE":
        base_name, base = step.follow(args[2])
        if base_name != "IFCCOMPOSITECURVE":
            raise Unswept(f"its alignment lies on {base_name}")
        return Alignment(plan_of(step, base[0], angle), profile_of(step, args[0]))
    if name == "IFCALIGNMENTCURVE":
        heights = Profile(vertical(step, args[1])) if args[1] else Profile()
        return Alignment(horizontal(step, args[0], angle), heights)
    if name == "IFCOFFSETCURVEBYDISTANCES":
        base = curve(step, args[0], angle)
        return Offset(base, [distance(step, p)[:3] for p in args[1]])
    raise Unswept(f"its directrix is of {name}")


def plan_of(step, segments, angle):
    plan = Plan()
    for segment in segments:
        name, args = step.follow(segment)
        if name == "IFCCOMPOSITECURVESEGMENT":
            corners = curve(step, args[2], angle)
            if not isinstance(corners, Polyline) or args[1] == ".F.":
                raise Unswept("its alignment has a piece of another kind")
            for a, b in zip(corners.corners[:-1], corners.corners[1:]):
                plan.add(a[0], a[1], math.atan2(b[1] - a[1], b[0] - a[0]), float(numpy.linalg.norm((b - a)[:2])))
            continue
        x, y, heading, length, k0, k1, bend = curve_segment(step, segment)
        if bend:
            raise Unswept("its alignment has a polynomial in plan")
        plan.add(x, y, heading, length, k0, k1)
    return plan


def profile_of(step, segments):
    pieces = []
    for segment in segments:
        x, z, slope, length, k0, k1, bend = curve_segment(step, segment)
        if k0 != k1:
            raise Unswept("its heights have a clothoid")
        # Lengths run along the slope, stations in plan.
        flat = length * math.cos(slope)
        pieces.append((x, flat, z, math.tan(slope), bend, 1 / k0 if k0 else 0.0))
    return Profile(pieces)


def horizontal(step, value, angle):
    """IfcAlignment2DHorizontal of drafts."""
    _, args = step.follow(value)
    plan = Plan()
    for segment in args[1]:
        kind, own = step.follow(step.follow(segment)[1][3])
        x, y, _ = step.point(own[0])
        heading, length = float(own[1]) * angle, float(own[2])
        if kind == "IFCLINESEGMENT2D":
            plan.add(x, y, heading, length)
        elif kind == "IFCCIRCULARARCSEGMENT2D":
            way = 1.0 if own[4] == ".T." else -1.0
            plan.add(x, y, heading, length, way / float(own[3]))
        elif kind == "IFCTRANSITIONCURVESEGMENT2D" and own[7] == ".CLOTHOIDCURVE.":
            ends = [(0.0 if not r else (1.0 if is_left == ".T." else -1.0) / float(r)) for r, is_left in ((own[3], own[5]), (own[4], own[6]))]
            plan.add(x, y, heading, length, *ends)
        else:
            raise Unswept(f"its alignment has a piece of {kind}" + (f" ({own[7].strip('.')})" if len(own) > 7 else ""))
    return plan


def vertical(step, value):
    """IfcAlignment2DVertical of drafts."""
    for segment in step.follow(value)[1][0]:
        kind, own = step.follow(segment)
        start, length, height, gradient = (float(x) for x in own[3:7])
        way = -1.0 if len(own) > 8 and own[8] == ".T." else 1.0
        if kind == "IFCALIGNMENT2DVERSEGLINE":
            yield start, length, height, gradient, 0.0, 0.0
        elif kind == "IFCALIGNMENT2DVERSEGCIRCULARARC":
            yield start, length, height, gradient, 0.0, way * float(own[7])
        elif kind == "IFCALIGNMENT2DVERSEGPARABOLICARC":
            yield start, length, height, gradient, way / float(own[7]), 0.0
        else:
            raise Unswept(f"its heights have a piece of {kind}")


def indexed(step, args):
    """Corners of an IfcIndexedPolyCurve; arcs through three points as chords."""
    points = [[float(c) for c in p] + [0.0] * (3 - len(p)) for p in step.follow(args[0])[1][0]]
    if not args[1]:
        return points
    found = []
    for indices in args[1]:
        own = [points[int(i) - 1] for i in indices]
        if getattr(indices, "kind", "") == "IFCARCINDEX":
            own = arc(*own)
        found += own[1 if found else 0:]
    return found


def arc(a, b, c):
    """Points of the arc from a over b to c, in the plane of their first two coordinates."""
    (ax, ay), (bx, by), (cx, cy) = a[:2], b[:2], c[:2]
    d = 2 * (ax * (by - cy) + bx * (cy - ay) + cx * (ay - by))
    if abs(d) < 1e-12:
        return [a, b, c]
    squares = [x * x + y * y for x, y in ((ax, ay), (bx, by), (cx, cy))]
    x = (squares[0] * (by - cy) + squares[1] * (cy - ay) + squares[2] * (ay - by)) / d
    y = (squares[0] * (cx - bx) + squares[1] * (ax - cx) + squares[2] * (bx - ax)) / d
    angles = [math.atan2(q - y, p - x) for p, q in ((ax, ay), (bx, by), (cx, cy))]
    turn = (angles[2] - angles[0]) % math.tau
    if (angles[1] - angles[0]) % math.tau > turn:
        turn -= math.tau
    radius, count = math.hypot(ax - x, ay - y), max(2, math.ceil(abs(turn) / 0.1))
    steps = [angles[0] + turn * i / count for i in range(count + 1)]
    return [a] + [[x + radius * math.cos(t), y + radius * math.sin(t), a[2]] for t in steps[1:-1]] + [c]


def distance(step, value):
    """Distance along, offset to the left, offset up."""
    name, args = step.follow(value)
    if name == "IFCAXIS2PLACEMENTLINEAR":
        return distance(step, args[0])
    if name not in ("IFCDISTANCEEXPRESSION", "IFCPOINTBYDISTANCEEXPRESSION"):
        raise Unswept(f"its sections lie at {name}")
    return float(args[0] or 0.0), float(args[1] or 0.0), float(args[2] or 0.0)


def rings(step, value):
    """Corners of a section: the outline, and its holes."""
    name, args = step.follow(value)
    if name in ("IFCARBITRARYCLOSEDPROFILEDEF", "IFCARBITRARYPROFILEDEFWITHVOIDS"):
        outlines = [args[2]] + (list(args[3]) if len(args) > 3 else [])
        return [without_end(curve(step, c, 1.0)) for c in outlines]
    if name == "IFCDERIVEDPROFILEDEF":
        raise Unswept("its sections are of IFCDERIVEDPROFILEDEF")
    x, y, heading = axis2d(step, args[2])
    turn = lambda points: [
        (x + math.cos(heading) * p - math.sin(heading) * q, y + math.sin(heading) * p + math.cos(heading) * q)
        for p, q in points
    ]
    size = [float(a) if isinstance(a, float) else 0.0 for a in args[3:]]
    box = lambda w, h: [(-w / 2, -h / 2), (w / 2, -h / 2), (w / 2, h / 2), (-w / 2, h / 2)]
    if name == "IFCRECTANGLEPROFILEDEF":
        return [turn(box(*size[:2]))]
    if name == "IFCRECTANGLEHOLLOWPROFILEDEF":
        return [turn(box(*size[:2])), turn(box(size[0] - 2 * size[2], size[1] - 2 * size[2]))]
    if name == "IFCCIRCLEPROFILEDEF":
        return [turn([(size[0] * math.cos(t), size[0] * math.sin(t)) for t in numpy.arange(48) * math.tau / 48])]
    if name == "IFCISHAPEPROFILEDEF":
        w, h, web, flange = (s / 2 if i != 3 else s for i, s in enumerate(size[:4]))
        right = [(w, -h), (w, flange - h), (web, flange - h), (web, h - flange), (w, h - flange), (w, h)]
        return [turn(right + [(-p, q) for p, q in reversed(right)])]
    if name == "IFCTSHAPEPROFILEDEF":
        h, w, web, flange = size[0] / 2, size[1] / 2, size[2] / 2, size[3]
        right = [(web, -h), (web, h - flange), (w, h - flange), (w, h)]
        return [turn(right + [(-p, q) for p, q in reversed(right)])]
    raise Unswept(f"its sections are of {name}")


def without_end(line):
    corners = [tuple(c[:2]) for c in line.corners] if isinstance(line, Polyline) else None
    if corners is None:
        raise Unswept("its sections have outlines of another kind")
    return corners[:-1] if math.dist(corners[0], corners[-1]) < 1e-9 * max(1.0, line.length) else corners


def upright(ring, is_hole):
    """Counter-clockwise, holes the other way."""
    area = sum(a[0] * b[1] - b[0] * a[1] for a, b in zip(ring, ring[1:] + ring[:1]))
    return ring if (area > 0) != is_hole else ring[::-1]


def solid(step, number, scale, angle):
    """Corners, and faces as lists of rings of indices from 1 on, of a sectioned solid."""
    _, args = step.get(number)
    directrix = curve(step, args[0], angle)
    places = [distance(step, p) for p in args[2]]
    profiles = [[upright(list(r), i > 0) for i, r in enumerate(rings(step, p))] for p in args[1]]
    if len(places) != len(profiles) or len(places) < 2:
        raise Unswept("it has not as many sections as places for them")
    if len({tuple(map(len, p)) for p in profiles}) > 1:
        raise Unswept("its sections have different numbers of corners")
    order = sorted(range(len(places)), key=lambda i: places[i][0])
    places, profiles = [places[i] for i in order], [profiles[i] for i in order]
    along = [p[0] for p in places]
    slack = 0.01 * directrix.length
    if along[0] < -slack or along[-1] > directrix.length + slack:
        raise Unswept(f"it runs from {along[0]:g} to {along[-1]:g} along an alignment of {directrix.length:g}")
    inner = [s for s in directrix.stations(scale) if along[0] < s < along[-1]]
    least = 1e-6 * max(1.0, along[-1] - along[0])
    stations = []
    for s in sorted(along + inner):
        if not stations or s - stations[-1] > least:
            stations.append(s)
    if len(stations) < 2 or len(stations) > MOST_STATIONS:
        raise Unswept("it has no length" if len(stations) < 2 else "it has too many stations")
    table = numpy.array([[c for ring in p for c in ring] for p in profiles])
    offsets = numpy.array([p[1:] for p in places])
    corners = []
    for s in stations:
        x, y, z, heading = directrix.at(s)
        k = int(min(max(numpy.searchsorted(along, s, side="right") - 1, 0), len(along) - 2))
        part = min(max((s - along[k]) / max(along[k + 1] - along[k], 1e-12), 0.0), 1.0)
        own = table[k] * (1 - part) + table[k + 1] * part
        left, up = offsets[k] * (1 - part) + offsets[k + 1] * part
        for p, q in own:
            corners.append((x - (p + left) * math.sin(heading), y + (p + left) * math.cos(heading), z + q + up))
    return corners, faces(profiles[0], len(stations))


def faces(profile, count):
    sizes = [len(ring) for ring in profile]
    total, firsts = sum(sizes), [sum(sizes[:i]) for i in range(len(sizes))]
    found = []
    for first, size in zip(firsts, sizes):
        for station in range(count - 1):
            here, there = station * total + first + 1, (station + 1) * total + first + 1
            for i in range(size):
                j = (i + 1) % size
                found += [[[here + i, here + j, there + j]], [[here + i, there + j, there + i]]]
    begin = [[first + 1 + i for i in range(size)] for first, size in zip(firsts, sizes)]
    end = [[(count - 1) * total + i for i in ring] for ring in begin]
    return found + [[ring[::-1] for ring in begin], end]


def written(number, free, corners, found):
    """Records of an IfcPolygonalFaceSet called `number`, others from `free` on."""
    numbers = ",".join("(" + ",".join(f"{c:.9f}" for c in corner) + ")" for corner in corners)
    lines, names = [f"#{free}=IFCCARTESIANPOINTLIST3D(({numbers}),$);"], []
    for i, rings_of in enumerate(found):
        outer, *inner = ["(" + ",".join(map(str, ring)) + ")" for ring in rings_of]
        name = free + 1 + i
        names.append(f"#{name}")
        if inner:
            lines.append(f"#{name}=IFCINDEXEDPOLYGONALFACEWITHVOIDS({outer},({','.join(inner)}));")
        else:
            lines.append(f"#{name}=IFCINDEXEDPOLYGONALFACE({outer});")
    lines.append(f"#{number}=IFCPOLYGONALFACESET(#{free},.T.,({','.join(names)}),$);")
    return lines, free + 1 + len(found)


def linear_placement(step, number, free, angle):
    """Records of a placement of drafts that is measured along a curve; its own place where it says
    one."""
    _, args = step.get(number)
    placed = [a for a in args if isinstance(a, tuple)]
    cartesian = next((a for a in placed if step.follow(a)[0] == "IFCAXIS2PLACEMENT3D"), None)
    if cartesian:
        return [f"#{number}=IFCLOCALPLACEMENT($,#{cartesian[1]});"], free
    along = next((a for a in placed if step.follow(a)[0] in ("IFCDISTANCEEXPRESSION", "IFCPOINTBYDISTANCEEXPRESSION")), None)
    basis = next((a for a in placed if "CURVE" in step.follow(a)[0] or "POLYLINE" in step.follow(a)[0]), None)
    if along and not basis:
        basis = step.follow(along)[1][4] if len(step.follow(along)[1]) > 4 else None
    if not along or not isinstance(basis, tuple):
        raise Unswept("its placement along a curve is not known")
    s, left, up = distance(step, along)
    x, y, z, heading = curve(step, basis, angle).at(s)
    x, y, z = x - left * math.sin(heading), y + left * math.cos(heading), z + up
    return [
        f"#{free}=IFCCARTESIANPOINT(({x:.9f},{y:.9f},{z:.9f}));",
        f"#{free + 1}=IFCDIRECTION((0.,0.,1.));",
        f"#{free + 2}=IFCDIRECTION(({math.cos(heading):.12f},{math.sin(heading):.12f},0.));",
        f"#{free + 3}=IFCAXIS2PLACEMENT3D(#{free},#{free + 1},#{free + 2});",
        f"#{number}=IFCLOCALPLACEMENT($,#{free + 3});",
    ], free + 4


def swept(text, is_draft):
    """The text with its sectioned solids, and what drafts place along curves, in shapes and places
    that every reader knows; and why some are left as they are, by their numbers."""
    step, reasons, changes = Step(text), {}, []
    if not step.at:
        return text, reasons
    free = max(step.at) + 1
    degrees = re.search(r"\.PLANEANGLEUNIT\.\s*,\s*'DEGREE'", text, re.I)
    angle = math.pi / 180 if degrees else 1.0
    milli = re.search(r"IFCSIUNIT\s*\(\s*\*\s*,\s*\.LENGTHUNIT\.\s*,\s*\.(MILLI|CENTI)\.", text, re.I)
    scale = {"MILLI": 1e-3, "CENTI": 1e-2}[milli.group(1).upper()] if milli else 1.0
    work = [(n, "solid") for n in step.of("IFCSECTIONEDSOLIDHORIZONTAL")]
    work += [(n, "place") for n in step.of("IFCLINEARPLACEMENT")] if is_draft else []
    for number, what in work:
        try:
            if what == "solid":
                lines, free = written(number, free, *solid(step, number, scale, angle))
            else:
                lines, free = linear_placement(step, number, free, angle)
            changes.append((step.at[number][2], "\n".join(lines)))
        except Unswept as why:
            reasons[number] = str(why)
        except (IndexError, ValueError, TypeError, ZeroDivisionError, RecursionError) as why:
            reasons[number] = f"it is damaged ({type(why).__name__})"
    parts, at = [], 0
    for (begin, end), lines in sorted(changes):
        parts += [text[at:begin], lines]
        at = end
    return "".join(parts) + text[at:], reasons


