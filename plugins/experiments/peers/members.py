"""Photographs of damaged members that Intrados has not rendered: by Mitsuba 3, with cracks, textures, lens and lamps of their own.

    pip install mitsuba shapely mapbox_earcut pillow scipy
    python3 members.py OUT [--first 0] [--count 20] [--set development|judged] [--spp 64]

Writes OUT/K/: scene.ron (the undamaged member as its drawings have it), photo.jpg, picks.csv, truth.json, reflectance.npy.
What the scene does not know: cracks, spalls, textures, colours to 10 %, where lamps are to 5 cm, the lens, vignetting, exposure and white balance.
score_members.py lets Intrados read them. All numbers come from the set, a seed and K."""
import argparse, json, math, os
import mapbox_earcut as earcut
import numpy as np
from PIL import Image
from scipy import ndimage
from shapely.geometry import Polygon, box
from shapely.ops import unary_union

W, H, D = 0.36, 0.36, 0.30          # of the member, m: across, up, deep; its front is z = D/2
COLUMNS, ROWS, FOCAL = 900, 840, 1800
TEXEL = 0.25e-3                     # of its texture, m
LIGHT = ["glancing", "bounce", "tunnel", "mild"]


def noise(rng, n, scale):
    """Smooth noise of unit deviation, n texels each way, features of `scale` texels."""
    m = max(4, int(n / scale) + 3)
    z = ndimage.zoom(rng.normal(size=(m, m)), n / (m - 2), order=3)[:n, :n]
    return (z - z.mean()) / z.std()


def texture(rng):
    """Reflectance of the front, rows from the top: paste, blotches, pores, lines of formwork, runs."""
    n = int(round(W / TEXEL))
    tone = 0.05 * noise(rng, n, 500) + 0.04 * noise(rng, n, 120) + 0.03 * noise(rng, n, 25) + 0.04 * rng.normal(size=(n, n))
    tone = ndimage.gaussian_filter(tone, 0.8)
    y, x = np.mgrid[:n, :n]
    for _ in range(rng.integers(60, 300)):                       # pores
        r = rng.exponential(2.5) + 1.0
        cx, cy = rng.uniform(0, n, 2)
        s = np.s_[max(0, int(cy - 3 * r)):int(cy + 3 * r) + 1, max(0, int(cx - 3 * r)):int(cx + 3 * r) + 1]
        tone[s] -= rng.uniform(0.3, 0.9) * (np.hypot(x[s] - cx, y[s] - cy) < r)
    if rng.random() < 0.5:                                       # formwork
        step, at = rng.uniform(250, 500), rng.uniform(0, 300)
        while at < n:
            tone -= rng.uniform(-0.08, 0.15) * np.exp(-0.5 * ((x - at - 2 * noise(rng, n, 300)) / 2.5) ** 2)
            at += step
    if rng.random() < 0.4:                                       # a run of water
        tone -= 0.15 * np.exp(-0.5 * ((x - rng.uniform(0, n) - 15 * noise(rng, n, 400)) / rng.uniform(20, 60)) ** 2)
    grey = rng.uniform(0.3, 0.48) * np.exp(tone)
    rgb = grey[..., None] * np.array([1.03, 1.0, 0.95]) ** rng.uniform(0.3, 1.5)
    return np.clip(ndimage.zoom(rgb, 1, order=0), 0.02, 0.9)


def walk(rng):
    """A crack: points on the front (m) and widths (mm), tapering to its ends."""
    way, at = rng.uniform(0, 2 * np.pi), rng.uniform([-0.1, 0.1], [0.1, 0.26])
    widest = float(np.exp(rng.uniform(np.log(0.1), np.log(1.0)))) if rng.random() < 0.85 else rng.uniform(1, 3)
    step, points = 1.2e-3, [at]
    turn = 0.0
    for _ in range(int(rng.uniform(0.06, 0.25) / step)):
        turn = 0.9 * turn + 0.16 * rng.normal()
        at = at + step * np.array([math.cos(way + turn), math.sin(way + turn)])
        if not (abs(at[0]) < W / 2 - 8e-3 and 8e-3 < at[1] < H - 8e-3):
            break
        points.append(at)
    n = len(points)
    s = np.linspace(0, 1, n)
    wavy = np.exp(0.25 * ndimage.gaussian_filter1d(rng.normal(size=n), 8) * 4)
    return np.array(points), widest * np.minimum(1, 4 * np.minimum(s, 1 - s) + 0.15) * np.clip(wavy, 0.6, 1.5)


def slot(points, widths):
    way = np.gradient(points, axis=0)
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    across = np.stack([-way[:, 1], way[:, 0]], 1) * (0.5e-3 * widths)[:, None]
    return Polygon(np.vstack([points + across, (points - across)[::-1]])).buffer(0)


class Mesh:
    def __init__(self):
        self.v, self.f = [], []

    def add(self, v, f):
        self.f += [[i + len(self.v) for i in t] for t in f]
        self.v += [list(p) for p in v]

    def flat(self, polygon, z):
        rings = [np.array(r.coords)[:-1] for r in [polygon.exterior, *polygon.interiors]]
        v = np.vstack(rings)
        t = earcut.triangulate_float64(v, np.cumsum([len(r) for r in rings]).astype(np.uint32)).reshape(-1, 3)
        a, b, c = (v[t[:, k]] for k in range(3))
        area = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
        t[area < 0] = t[area < 0][:, ::-1]
        self.add([(x, y, z) for x, y in v], t.tolist())

    def wall(self, ring, high, low):
        r = np.array(ring.coords)[:-1]
        n = len(r)
        self.add([(x, y, high) for x, y in r] + [(x, y, low) for x, y in r], [t for k in range(n) for t in ([k, (k + 1) % n, n + k], [(k + 1) % n, n + (k + 1) % n, n + k])])

    def shape(self, mi, name, bsdf):
        m = mi.Mesh(name, len(self.v), len(self.f), has_vertex_texcoords=True)
        p = mi.traverse(m)
        v = np.array(self.v, np.float32)
        p["vertex_positions"], p["faces"] = v.ravel(), np.array(self.f, np.uint32).ravel()
        p["vertex_texcoords"] = np.stack([v[:, 0] / W + 0.5, v[:, 1] / H], 1).astype(np.float32).ravel()
        p.update()
        folder = os.environ.get("TMPDIR", "/tmp")
        path = os.path.join(folder, f"member-{os.getpid()}-{name}.ply")
        m.write_ply(path)
        shape = mi.load_dict({"type": "ply", "filename": path, "face_normals": True, "bsdf": bsdf})
        os.remove(path)
        return shape


def scenery(kind, rng):
    """Walls (corner, u, v, colour) and lamps (position, intensity), sky."""
    floor = ((-2, 0, 2), (4, 0, 0), (0, 0, -4), (0.3, 0.29, 0.27))
    if kind == "glancing":
        return [floor], [((-0.55, rng.uniform(0.1, 0.5), D / 2 + rng.uniform(0.08, 0.16)), (0.35, 0.33, 0.3))], 0.08
    if kind == "bounce":
        red = ((-0.42, 0, -0.3), (0, 0, 1.3), (0, 1.2, 0), (0.62, 0.08, 0.06))
        return [floor, red], [((0.5, 0.9, 0.55), (0.55, 0.55, 0.52))], 0.05
    if kind == "tunnel":
        pale = (0.6, 0.58, 0.52)
        sides = [((-0.8, 0, -1.4), (0, 0, 3.2), (0, 1.5, 0), pale), ((0.8, 0, 1.8), (0, 0, -3.2), (0, 1.5, 0), pale),
                 ((-0.8, 1.5, -1.4), (0, 0, 3.2), (1.6, 0, 0), pale), ((-0.8, 0, -1.4), (0, 1.5, 0), (1.6, 0, 0), pale),
                 ((-0.8, 0, 1.8), (1.6, 0, 0), (0, 1.5, 0), pale)]
        return [floor, *sides], [((rng.uniform(-0.5, 0.5), 1.2, -0.5), (1.2, 1.1, 0.9))], 0.0
    return [floor], [((0.7, 1.3, 1.6), (1.5, 1.45, 1.35))], 0.25


def look_at(position, target):
    f = (target - position) / np.linalg.norm(target - position)
    r = np.cross(f, [0, 1, 0])
    r /= np.linalg.norm(r)
    return np.stack([r, np.cross(r, f), f])


def project(axes, position, lens, p):
    d = axes @ (np.array(p) - position)
    x, y = d[0] / d[2], -d[1] / d[2]
    q = 1 + lens[0] * (x * x + y * y) + lens[1] * (x * x + y * y) ** 2
    return [COLUMNS / 2 + FOCAL * x * q, ROWS / 2 + FOCAL * y * q]


def photograph(image, lens, rng):
    """What a camera makes of a pinhole's picture that is a sixth larger all around."""
    v, u = np.mgrid[:ROWS, :COLUMNS] + 0.5
    xd, yd = (u - COLUMNS / 2) / FOCAL, (v - ROWS / 2) / FOCAL
    x, y = xd.copy(), yd.copy()
    for _ in range(12):
        r2 = x * x + y * y
        q = 1 + lens[0] * r2 + lens[1] * r2 * r2
        x, y = xd / q, yd / q
    h, w = image.shape[:2]
    at = [y * FOCAL + h / 2 - 0.5, x * FOCAL + w / 2 - 0.5]
    seen = np.stack([ndimage.map_coordinates(image[..., c], at, order=3, mode="nearest") for c in range(3)], -1)
    seen = np.stack([ndimage.gaussian_filter(seen[..., c], 0.5) for c in range(3)], -1)
    r2 = ((u - COLUMNS / 2) ** 2 + (v - ROWS / 2) ** 2) / ((COLUMNS / 2) ** 2 + (ROWS / 2) ** 2)
    seen *= (1 - rng.uniform(0.05, 0.3) * r2)[..., None] * rng.uniform(0.85, 1.15, 3)
    seen *= 0.8 / np.percentile(seen, 97)
    seen += rng.normal(size=seen.shape) * np.sqrt(1e-6 + 1.5e-4 * seen.clip(0))
    seen = seen.clip(0, 1)
    return (255 * np.where(seen < 0.0031308, 12.92 * seen, 1.055 * seen ** (1 / 2.4) - 0.055) + 0.5).astype(np.uint8)


def member(mi, folder, k, rng, spp):
    kind = LIGHT[k % 4]
    cracks = [walk(rng) for _ in range(rng.choice([0, 1, 2, 3], p=[0.15, 0.3, 0.35, 0.2]))]
    cracks = [c for c in cracks if len(c[0]) > 20]
    spalls = [(rng.uniform(-0.1, 0.1), rng.uniform(0.08, 0.28), rng.uniform(0.012, 0.035), rng.uniform(6e-3, 15e-3))] if rng.random() < 0.3 else []
    T, tex = mi.ScalarTransform4f, texture(rng)
    inner = {"type": "diffuse", "reflectance": {"type": "rgb", "value": [0.33, 0.32, 0.3]}}
    holes = [slot(*c) for c in cracks]
    disks = [Polygon([(x + r * (1 + 0.12 * math.sin(3 * a + x * 90) + 0.08 * math.sin(7 * a)) * math.cos(a), y + r * (1 + 0.12 * math.sin(3 * a + x * 90) + 0.08 * math.sin(7 * a)) * math.sin(a)) for a in np.linspace(0, 2 * np.pi, 96, endpoint=False)]) for x, y, r, _ in spalls]
    gone = unary_union(holes).difference(unary_union(disks)) if disks else unary_union(holes)
    whole = box(-W / 2, 0, W / 2, H).difference(unary_union(holes + disks))
    front, inside, bowl = Mesh(), Mesh(), Mesh()
    for part in getattr(whole, "geoms", [whole]):
        front.flat(part, D / 2)
    for part in getattr(gone, "geoms", [gone]):
        if part.is_empty or part.geom_type != "Polygon":
            continue
        depth = rng.uniform(8e-3, 40e-3)
        inside.flat(part, D / 2 - depth)
        for ring in [part.exterior, *part.interiors]:
            inside.wall(ring, D / 2, D / 2 - depth)
    for disk, (x, y, r, depth) in zip(disks, spalls):
        rim, n, m = np.array(disk.exterior.coords)[:-1], 96, 10
        v = [(x + (p[0] - x) * (1 - j / m), y + (p[1] - y) * (1 - j / m), D / 2 - (0 if j == 0 else depth * (1 - (1 - j / m) ** 2) * (1 + 0.15 * rng.normal()))) for j in range(m + 1) for p in rim]
        bowl.add(v, [t for j in range(m) for i in range(n) for t in ([j * n + i, j * n + (i + 1) % n, (j + 1) * n + i], [j * n + (i + 1) % n, (j + 1) * n + (i + 1) % n, (j + 1) * n + i])])
    mean = tex.mean((0, 1))
    walls, lamps, sky = scenery(kind, rng)
    body = {"type": "twosided", "b": {"type": "diffuse", "reflectance": {"type": "rgb", "value": mean.tolist()}}}
    skin = {"type": "twosided", "b": {"type": "diffuse", "reflectance": {"type": "bitmap", "bitmap": mi.Bitmap(tex[::-1].astype(np.float32).copy()), "raw": True}}}
    if os.environ.get("MEMBERS_FLIP"):
        skin["b"]["reflectance"]["bitmap"] = mi.Bitmap(tex.astype(np.float32).copy())
    scene = {"type": "scene", "integrator": {"type": "path", "max_depth": 12, "rr_depth": 6}, "front": front.shape(mi, "front", skin)}
    for name, mesh in [("inside", inside), ("bowl", bowl)]:
        if mesh.f:
            scene[name] = mesh.shape(mi, name, {"type": "twosided", "b": inner})

    def quad(corner, u, v, colour):
        c, u, v = map(np.array, (corner, u, v))
        m = T(np.vstack([np.stack([u / 2, v / 2, np.cross(u, v) / np.linalg.norm(np.cross(u, v)), c + u / 2 + v / 2], 1), [0, 0, 0, 1]]).tolist())
        return {"type": "rectangle", "to_world": m, "bsdf": {"type": "twosided", "b": {"type": "diffuse", "reflectance": {"type": "rgb", "value": [float(x) for x in colour]}}}}
    x, z = W / 2, D / 2
    for i, (c, u, v) in enumerate([((x, 0, z), (0, 0, -D), (0, H, 0)), ((-x, 0, -z), (0, 0, D), (0, H, 0)), ((x, 0, -z), (-W, 0, 0), (0, H, 0)), ((-x, H, z), (W, 0, 0), (0, 0, -D))]):
        scene[f"side{i}"] = quad(c, u, v, mean)
    for i, w in enumerate(walls):
        scene[f"wall{i}"] = quad(*w)
    for i, (p, a) in enumerate(lamps):
        off = rng.normal(size=3)
        scene[f"lamp{i}"] = {"type": "point", "position": (np.array(p) + 0.05 * off / np.linalg.norm(off)).tolist(), "intensity": {"type": "rgb", "value": list(a)}}
    if sky:
        scene["sky"] = {"type": "constant", "radiance": {"type": "rgb", "value": [sky, sky, sky]}}
    position = np.array([rng.uniform(0.3, 0.45), rng.uniform(0.15, 0.4), D / 2 + 0.9])
    target = np.array([0.02, H / 2, D / 2 - 0.05])
    axes = look_at(position, target)
    wide, high = int(COLUMNS * 7 / 6), int(ROWS * 7 / 6)
    scene["sensor"] = {"type": "perspective", "fov": math.degrees(2 * math.atan(wide / 2 / FOCAL)), "fov_axis": "x",
                       "to_world": T().look_at(origin=position.tolist(), target=target.tolist(), up=[0, 1, 0]),
                       "film": {"type": "hdrfilm", "width": wide, "height": high, "rfilter": {"type": "box"}}, "sampler": {"type": "independent"}}
    built = mi.load_dict(scene)
    image, step = 0, 32
    for i in range(max(1, spp // step)):
        image = image + np.array(mi.render(built, spp=step, seed=int(1000 * k + i)))[..., :3] / max(1, spp // step)
    lens = (rng.uniform(-0.06, 0.03), rng.uniform(-0.01, 0.02))
    jpeg = Image.fromarray(photograph(image, lens, rng))
    exif = Image.Exif()
    exif.get_ifd(0x8769)[0xA405] = int(round(FOCAL * 43.27 / math.hypot(COLUMNS, ROWS)))
    os.makedirs(folder, exist_ok=True)
    jpeg.save(f"{folder}/photo.jpg", quality=92, exif=exif)
    corners = [(-x, 0, z), (x, 0, z), (-x, H, z), (x, H, z), (x, 0, -z), (x, H, -z)]
    with open(f"{folder}/picks.csv", "w") as out:
        out.write("u,v,x,y,z\n")
        for c in corners:
            u, v = np.array(project(axes, position, lens, c)) + rng.normal(size=2)
            if 0 < u < COLUMNS and 0 < v < ROWS:
                out.write(f"{u:.2f},{v:.2f},{c[0]},{c[1]},{c[2]}\n")
    wrong = lambda c: ", ".join(f"{min(0.9, v * rng.uniform(0.9, 1.1)):.3f}" for v in c)
    triple = lambda p: "(" + ", ".join(f"{v:.4f}" for v in p) + ")"
    materials = "".join(f'        (name: "wall {i}", colour: ({wrong(w[3])})),\n' for i, w in enumerate(walls))
    shapes = "".join(f'        Quad(name: "wall {i}", corner: {triple(w[0])}, u: {triple(w[1])}, v: {triple(w[2])}, material: "wall {i}"),\n' for i, w in enumerate(walls))
    lit = "".join(f'        Point(name: "lamp {i}", position: {triple(p)}, strength: WattPerSteradian({max(a)}), colour: {triple(np.array(a) / max(a))}),\n' for i, (p, a) in enumerate(lamps))
    lit += f'        Environment(name: "sky", radiance: ({sky}, {sky}, {sky})),\n' if sky else ""
    with open(f"{folder}/scene.ron", "w") as out:
        out.write(f"""(
    schema: "intrados.scene/1",
    title: "Member {k}, {kind}",
    materials: [
        (name: "concrete", colour: ({wrong(mean)})),
{materials}    ],
    shapes: [
{shapes}    ],
    members: [(
        id: "M", name: "Member",
        body: Column(section: Rectangle(width_m: {W}, depth_m: {D}), height_m: {H},
            reinforcement: (cover_mm: 35, bars: [Around(count: 8, diameter_mm: 16)], stirrups: (diameter_mm: 8, spacing_mm: 100))),
        at: (0, 0, 0), concrete: "C30/37", material: "concrete", exposure: (class: "XC3", years: 30),
        truth: [],
    )],
    lamps: [
{lit}    ],
)
""")
    np.save(f"{folder}/reflectance.npy", tex.astype(np.float32))
    json.dump({"light": kind, "position": position.tolist(), "axes": axes.tolist(), "focal_px": FOCAL, "lens": lens, "texel_m": TEXEL,
               "cracks": [{"points": p.tolist(), "width_mm": w.tolist()} for p, w in cracks], "spalls": spalls}, open(f"{folder}/truth.json", "w"))


if __name__ == "__main__":
    a = argparse.ArgumentParser()
    a.add_argument("out"); a.add_argument("--first", type=int, default=0); a.add_argument("--count", type=int, default=20)
    a.add_argument("--set", choices=["development", "judged"], default="development"); a.add_argument("--spp", type=int, default=64)
    a = a.parse_args()
    import mitsuba as mi
    mi.set_variant("scalar_rgb")
    for k in range(a.first, a.first + a.count):
        member(mi, f"{a.out}/{k}", k, np.random.default_rng([{"development": 1, "judged": 2}[a.set], k]), a.spp)
        print(k, LIGHT[k % 4], flush=True)
