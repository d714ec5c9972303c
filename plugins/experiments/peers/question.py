"""Does taking the light off help? The same network and rules on photographs of members.py in four ways:

    a  as they are                                   --light none
    b  after local contrast normalisation, then      --light none
    c  relit with direct light only                  --light direct
    d  relit with global illumination                --light all

    python3 question.py OUT [--intrados target/release/intrados]

OUT holds members of members.py. What was read is kept (OUT/K/read-WAY.json) and not read again. One JSON line a member and way: F1 of
points of cracks at 1 mm, width error, and the error of the member's damage, by the program's own rule for findings (a crack across or
askew costs half of width/1 mm times length/side; the worst counts) applied to what was read and to what was planted. Then, of d against
each other way, mean differences with 95 % intervals (bootstrap over members) and Wilcoxon's signed ranks. Chosen on the development
members: nothing but b's reach of 16 pixels, which is also the network's own."""
import argparse, glob, json, math, os, subprocess
import numpy as np
from PIL import Image
from scipy import ndimage, stats
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
    return {"member": int(folder.rsplit("/", 1)[1]), "way": way, "light": truth["light"], "f1": round(f1, 4), "recall": round(recall, 3), "precision": round(precision, 3),
            "damage_error": round(abs(damage(found(photo)) - damage(planted(truth))), 4), "width_bias_mm": round(float(np.mean(wide)), 3) if wide else None,
            "width_rms_mm": round(float(np.sqrt(np.mean(np.square(wide)))), 3) if wide else None, **({"error": said["error"]} if "error" in said else {})}


def paired(x, y, rng):
    d = np.array(x) - np.array(y)
    means = d[rng.integers(0, len(d), (10_000, len(d)))].mean(1)
    p = float(stats.wilcoxon(d).pvalue) if np.any(d) else 1.0
    return {"mean": round(float(d.mean()), 4), "interval": [round(float(q), 4) for q in np.percentile(means, [2.5, 97.5])], "p": round(p, 4)}


if __name__ == "__main__":
    a = argparse.ArgumentParser()
    a.add_argument("out"); a.add_argument("--intrados", default="target/release/intrados")
    a = a.parse_args()
    folders = sorted(glob.glob(f"{a.out}/[0-9]*"), key=lambda p: int(p.rsplit("/", 1)[1]))
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
