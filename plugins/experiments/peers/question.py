"""Does taking the light off help? The same network and rules on photographs of members.py in four ways:

    a  as they are                                   --light none
    b  after local contrast normalisation, then      --light none
    c  relit with direct light only                  --light direct
    d  relit with global illumination                --light all

    python3 question.py OUT [--intrados target/release/intrados]
    python3 question.py OUT --marks target/release/examples/marks --weights pasted=PASTED.f32 direct=DIRECT.f32 global=GLOBAL.f32

The second reads the relit maps of d with networks that were trained alike on other lessons (pasted, without light; direct light; with bounces), pixels of the
mask against the planted cracks at 1 mm.

OUT holds members of members.py. What was read is kept (OUT/K/read-WAY.json) and not read again. One JSON line a member and way: F1 of
points of cracks at 1 mm, width error, and the error of the member's damage, by the program's own rule for findings (a crack across or
askew costs half of width/1 mm times length/side; the worst counts) applied to what was read and to what was planted. Then, of d against
each other way, mean differences with 95 % intervals (bootstrap over members) and Wilcoxon's signed ranks. Chosen on the development
members: nothing but b's reach of 16 pixels, which is also the network's own."""
import argparse, glob, json, math, os, shutil, subprocess
import numpy as np
from PIL import Image
from scipy import ndimage, stats
from scipy.spatial import cKDTree
import score_members as score

WAYS = {"a": "none", "b": "none", "c": "direct", "d": "all"}
REACH = 16                     # of b's means, pixels
SIDE, OPEN_MM, DEPTH = 0.36, 1.0, 0.5


def normalised(folder):
    """Linear light over its mean around, its deviation around evened out."""
    path = f"{folder}/normalised.png"
    if not os.path.exists(path):
        image = Image.open(f"{folder}/photo.jpg")
        light = score.linear(np.asarray(image, float) / 255)
        soft = lambda x: np.stack([ndimage.gaussian_filter(x[..., c], REACH) for c in range(3)], -1)
        ratio = light / np.maximum(soft(light), 1e-4)
        scatter = np.sqrt(np.maximum(soft((ratio - 1) ** 2).mean(-1, keepdims=True), 1e-8))
        even = np.clip(0.4 * (1 + (ratio - 1) / scatter * np.median(scatter)), 0, 1)
        coded = np.where(even < 0.0031308, 12.92 * even, 1.055 * even ** (1 / 2.4) - 0.055)
        Image.fromarray((255 * coded + 0.5).astype(np.uint8)).save(path, exif=image.getexif())
    return path


def read(program, folder, way):
    kept = f"{folder}/read-{way}.json"
    if not os.path.exists(kept):
        photo = normalised(folder) if way == "b" else f"{folder}/photo.jpg"
        words = [program, "photo", f"{folder}/scene.ron", photo, "--pose", f"{folder}/picks.csv", "--read", "--member", "M", "--mm-per-px", "0.5",
                 "--focal-px", "1800", "--out", f"{folder}/way-{way}", "--format", "json", "--quiet", *([] if way == "d" else ["--light", WAYS[way]])]
        done = subprocess.run(words, capture_output=True, text=True)
        with open(kept + ".part", "w") as out:
            out.write(done.stdout if done.returncode == 0 else json.dumps({"photos": [], "error": done.stderr.strip()}))
        os.rename(kept + ".part", kept)
    return json.load(open(kept))


def damage(cracks):
    """Of cracks (widest, mm; length, m; along?) the share of strength that the worst costs."""
    return max([min(1, w / OPEN_MM) * min(1, length / SIDE) * DEPTH for w, length, along in cracks if not along] or [0.0])


def planted(truth):
    for crack in truth["cracks"]:
        p, w = score.points(crack)
        chord = np.abs(p[-1] - p[0])
        yield float(w.max()), float(np.linalg.norm(np.diff(p, axis=0), axis=1).sum()), math.atan2(chord[0], chord[1]) < math.radians(30)


def found(photo):
    for face in photo.get("read", []):
        for d in face["defects"]:
            if face["face"] == "Front" and d["kind"] == "crack":
                yield d["widest_mm"], d["length_m"], d["course"].lower() == "along"


def member(program, folder, way):
    truth, said = json.load(open(f"{folder}/truth.json")), read(program, folder, way)
    photo = said["photos"][0] if said["photos"] else {}
    c = score.cracks(photo, truth)
    recall, precision = c["found_of"][0] / max(1, c["found_of"][1]), c["true_of"][0] / max(1, c["true_of"][1])
    if not c["found_of"][1]:
        f1 = float(c["true_of"][0] == c["true_of"][1])
    else:
        f1 = 2 * recall * precision / max(1e-9, recall + precision)
    wide = [f - t for t, f, _ in c["rows"] if 0.1 <= t <= 1]
    held = [abs(f - t) < 1.96 * s for t, f, s in c["rows"] if 0.1 <= t <= 1 and s]
    return {"member": int(folder.rsplit("/", 1)[1]), "way": way, "light": truth["light"], "f1": round(f1, 4), "recall": round(recall, 3), "precision": round(precision, 3),
            "damage_error": round(abs(damage(found(photo)) - damage(planted(truth))), 4), "width_bias_mm": round(float(np.mean(wide)), 3) if wide else None,
            "width_rms_mm": round(float(np.sqrt(np.mean(np.square(wide)))), 3) if wide else None, "width_points": len(wide),
            "width_within": round(float(np.mean(held)), 3) if held else None, **({"error": said["error"]} if "error" in said else {})}


def trained(marks, out, folders, name, weights):
    """F1 of pixels by member, of the network `weights` on the maps of d."""
    maps, masks = f"{out}/maps", f"{out}/masks-{name}"
    os.makedirs(maps, exist_ok=True)
    for folder in folders:
        source = f"{folder}/way-d/photo.jpg_M_Front_relit.png"
        if os.path.exists(source):
            shutil.copy(source, f"{maps}/{folder.rsplit('/', 1)[1]}.png")
    subprocess.run([marks, maps, masks, weights], check=True, stdout=subprocess.DEVNULL)
    rows = []
    for folder in folders:
        k, truth, said = folder.rsplit("/", 1)[1], json.load(open(f"{folder}/truth.json")), json.load(open(f"{folder}/read-d.json"))
        face = next((f for f in said["photos"][0]["faces"] if f["face"] == "Front"), None) if said["photos"] else None
        if face is None or not os.path.exists(f"{masks}/{k}.png"):
            continue
        mask = np.asarray(Image.open(f"{masks}/{k}.png")) > 127
        left, top = face["map_corner_m"]
        y, x = np.nonzero(mask)
        found = np.stack([left + (x + 0.5) * 5e-4, top - (y + 0.5) * 5e-4], 1)
        true = [score.points(c) for c in truth["cracks"]]
        near = lambda p: any(math.hypot(p[0] - a, p[1] - b) < 1.5 * r for a, b, r, _ in truth["spalls"])
        if not true:
            rows.append(float(not [p for p in found if not near(p)]))
            continue
        points, width = np.concatenate([p for p, _ in true]), np.concatenate([w for _, w in true])
        if not len(found):
            rows.append(0.0)
            continue
        distance, at = cKDTree(points).query(found)
        real = (distance < 1e-3 + 0.5e-3 * width[at]) | np.array([near(p) for p in found])
        recall = (cKDTree(found).query(points)[0] < 1e-3 + 0.5e-3 * width).mean()
        rows.append(2 * recall * real.mean() / max(1e-9, recall + real.mean()))
    return rows


def paired(x, y, rng):
    d = np.array(x) - np.array(y)
    means = d[rng.integers(0, len(d), (10_000, len(d)))].mean(1)
    p = float(stats.wilcoxon(d).pvalue) if np.any(d) else 1.0
    return {"mean": round(float(d.mean()), 4), "interval": [round(float(q), 4) for q in np.percentile(means, [2.5, 97.5])], "p": round(p, 4)}


if __name__ == "__main__":
    a = argparse.ArgumentParser()
    a.add_argument("out"); a.add_argument("--intrados", default="target/release/intrados")
    a.add_argument("--marks"); a.add_argument("--weights", nargs="*", default=[])
    a = a.parse_args()
    folders = sorted(glob.glob(f"{a.out}/[0-9]*"), key=lambda p: int(p.rsplit("/", 1)[1]))
    if a.marks:
        named = dict(w.split("=", 1) for w in a.weights)
        f1 = {name: trained(a.marks, a.out, folders, name, weights) for name, weights in named.items()}
        for name in f1:
            print(json.dumps({"trained": name, "f1": round(float(np.mean(f1[name])), 3), "by_member": [round(float(v), 3) for v in f1[name]]}))
        for other in set(f1) - {"global"} if "global" in f1 else ():
            print(json.dumps({"global_against": other, "f1": paired(f1["global"], f1[other], np.random.default_rng(1))}))
        raise SystemExit
    rows = {way: [] for way in WAYS}
    for folder in folders:
        for way in WAYS:
            rows[way].append(member(a.intrados, folder, way))
            print(json.dumps(rows[way][-1]), flush=True)
    rng, of = np.random.default_rng(1), lambda way, key: [r[key] for r in rows[way]]
    for way in WAYS:
        print(json.dumps({"way": way, "members": len(folders), "f1": round(float(np.mean(of(way, "f1"))), 3), "damage_error": round(float(np.mean(of(way, "damage_error"))), 4),
                          "f1_by_light": {k: round(float(np.mean([r["f1"] for r in rows[way] if r["light"] == k])), 3) for k in sorted(set(of(way, "light")))}}))
    for way in "abc":
        print(json.dumps({"d_against": way, **{key: paired(of("d", key), of(way, key), rng) for key in ("f1", "damage_error")}}))
