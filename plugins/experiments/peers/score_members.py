"""Lets Intrados read the photographs of members.py and compares with what was rendered.

    pip install opencv-python-headless scipy
    python3 score_members.py OUT [--intrados target/release/intrados] [--light all]

One JSON line a member and one of all: pose (share of the distance), reflectance within 1.96 of its standard errors (after one factor a
channel, damage and its rim left out), points of cracks found and false at 1 mm, widths by bins (bias and rms, mm), detection against the
limit that Intrados states."""
import argparse, glob, json, math, os, subprocess
import cv2
import numpy as np
from scipy import ndimage
from scipy.spatial import cKDTree

BINS = [(0.1, 0.2), (0.2, 0.4), (0.4, 0.7), (0.7, 1.01), (1.01, 4)]
W, H = 0.36, 0.36


def linear(s):
    return np.where(s <= 0.04045, s / 12.92, ((s + 0.055) / 1.055) ** 2.4)


def deep(path):
    """A PNG of sixteen bits a channel, 0 to 1."""
    read = cv2.imread(path, cv2.IMREAD_UNCHANGED)
    return (read[..., ::-1] if read.ndim == 3 else read).astype(float) / 65535


def run(program, folder, light):
    out = f"{folder}/read-{light}"
    words = [program, "photo", f"{folder}/scene.ron", f"{folder}/photo.jpg", "--pose", f"{folder}/picks.csv", "--read", *([] if light == "all" else ["--light", light]),
             "--mm-per-px", "0.5", "--member", "M", "--out", out, "--format", "json", "--quiet"]
    done = subprocess.run(words, capture_output=True, text=True)
    return (json.loads(done.stdout) if done.returncode == 0 else {"error": done.stderr.strip()}), out


def points(crack):
    return np.array(crack["points"]), np.array(crack["width_mm"])


def relit(photo, out, folder, truth):
    face = next((f for f in photo["faces"] if f["face"] == "Front"), None)
    path = f"{out}/photo.jpg_M_Front_relit.png"
    if face is None or not os.path.exists(path):
        return None
    rho, error = linear(deep(path)), deep(path.replace("_relit", "_relit_error"))
    if error.ndim == 2:
        error = np.repeat(error[..., None], 3, 2)
    known = (rho.max(-1) > 0) & (error.max(-1) < 1)
    tex = np.load(f"{folder}/reflectance.npy").astype(float)
    n = tex.shape[0] // 2
    tex = tex[:2 * n, :2 * n].reshape(n, 2, n, 2, 3).mean((1, 3))          # .5 mm
    # The photograph's own blur is in the map, too.
    tex = np.stack([ndimage.gaussian_filter(tex[..., c], 0.6) for c in range(3)], -1)
    spoilt = np.zeros((n, n), bool)
    for crack in truth["cracks"]:
        p, _ = points(crack)
        spoilt[np.clip(((H - p[:, 1]) / 5e-4).astype(int), 0, n - 1), np.clip(((p[:, 0] + W / 2) / 5e-4).astype(int), 0, n - 1)] = True
    spoilt = ndimage.binary_dilation(spoilt, iterations=8)
    y, x = np.mgrid[:n, :n]
    for sx, sy, r, _ in truth["spalls"]:
        spoilt |= np.hypot((x + 0.5) * 5e-4 - W / 2 - sx, H - (y + 0.5) * 5e-4 - sy) < 1.4 * r
    left, top = face["relit_corner_m"] if "relit_corner_m" in face else (math.floor(face["map_corner_m"][0] / 5e-4) * 5e-4, math.ceil(face["map_corner_m"][1] / 5e-4) * 5e-4)
    rows, columns = np.nonzero(known)
    v, u = (H - (top - (rows + 0.5) * 5e-4)) / 5e-4, (left + (columns + 0.5) * 5e-4 + W / 2) / 5e-4
    inside = (v > 4) & (v < n - 4) & (u > 4) & (u < n - 4)
    rows, columns, v, u = rows[inside], columns[inside], v[inside], u[inside]
    fine = ~spoilt[v.astype(int), u.astype(int)]
    rows, columns, v, u = rows[fine], columns[fine], v[fine], u[fine]
    held, slow = [], []
    for c in range(3):
        true = ndimage.map_coordinates(tex[..., c], [v - 0.5, u - 0.5], order=1)
        d = np.log(rho[rows, columns, c] / true)
        d -= np.median(d)
        held.append((np.abs(d) < 1.96 * error[rows, columns, c]).mean())
        tile = (rows // 80) * 1000 + columns // 80
        _, index = np.unique(tile, return_inverse=True)
        count = np.bincount(index)
        slow.append((np.bincount(index, d) / count)[count > 2000].std())
    return {"within": float(np.mean(held)), "slow_rms": float(np.mean(slow)), "known": float(known.mean())}


def cracks(photo, truth):
    true = [points(c) for c in truth["cracks"]]
    t = np.concatenate([p for p, _ in true]) if true else np.zeros((0, 2))
    w = np.concatenate([w for _, w in true]) if true else np.zeros(0)
    found, width, error, narrowest = [], [], [], None
    for face in photo.get("read", []):
        if face["face"] != "Front":
            continue
        narrowest = face["narrowest_mm"]
        for d in face["defects"]:
            if d["kind"] == "crack":
                for p in d["points"]:
                    if p["width_mm"] is not None:
                        found.append((p["across_m"], p["along_m"])); width.append(p["width_mm"]); error.append(p["error_mm"])
    f = np.array(found).reshape(-1, 2)
    spalls = lambda p: any(math.hypot(p[0] - x, p[1] - y) < 1.5 * r for x, y, r, _ in truth["spalls"])
    hit = cKDTree(f).query(t)[0] < 2.5e-3 if len(f) and len(t) else np.zeros(len(t), bool)
    near = cKDTree(t).query(f) if len(f) and len(t) else (np.full(len(f), 9.0), np.zeros(len(f), int))
    real = np.array([d < 1e-3 or spalls(p) for d, p in zip(near[0], f)], bool)
    rows = [(float(w[i]), wf, e) for d, i, wf, e in zip(near[0], near[1], width, error) if d < 1e-3]
    return {"found_of": [int(hit.sum()), len(t)], "true_of": [int(real.sum()), len(f)], "rows": rows, "narrowest_mm": narrowest,
            "by_width": [(float(x), bool(h)) for x, h in zip(w, hit)]}


def widths(rows):
    out = []
    for low, high in BINS:
        e = np.array([f - t for t, f, _ in rows if low <= t < high])
        z = np.array([(f - t) / s for t, f, s in rows if low <= t < high and s])
        if len(e):
            out.append({"mm": [low, high], "points": len(e), "bias": round(e.mean(), 3), "rms": round(float(np.sqrt((e ** 2).mean())), 3), "within": round(float((np.abs(z) < 1.96).mean()), 3)})
    return out


if __name__ == "__main__":
    a = argparse.ArgumentParser()
    a.add_argument("out"); a.add_argument("--intrados", default="target/release/intrados"); a.add_argument("--light", default="all")
    a = a.parse_args()
    all_rows, hits, trues, poses, held, f1s, seen = [], np.zeros(2), np.zeros(2), [], [], [], []
    for folder in sorted(glob.glob(f"{a.out}/[0-9]*"), key=lambda p: int(p.rsplit("/", 1)[1])):
        truth = json.load(open(f"{folder}/truth.json"))
        said, out = run(a.intrados, folder, a.light)
        if "error" in said or not said["photos"]:
            print(json.dumps({"member": folder, "error": said.get("error", said.get("unused"))})); continue
        photo = said["photos"][0]
        pose = np.linalg.norm(np.array(photo["pose"]["position_m"]) - truth["position"]) / 0.9
        c, r = cracks(photo, truth), relit(photo, out, folder, truth)
        recall, precision = c["found_of"][0] / max(1, c["found_of"][1]), c["true_of"][0] / max(1, c["true_of"][1])
        f1 = float(c["true_of"][0] == c["true_of"][1]) if not c["found_of"][1] else 2 * recall * precision / max(1e-9, recall + precision)
        print(json.dumps({"member": folder, "light": truth["light"], "pose": round(pose, 4), "relit": r, "found": c["found_of"], "true": c["true_of"], "f1": round(f1, 3), "narrowest_mm": c["narrowest_mm"]}), flush=True)
        all_rows += c["rows"]; hits += c["found_of"]; trues += c["true_of"]; poses.append(pose); f1s.append(f1)
        seen += [(x >= (c["narrowest_mm"] or 9), h) for x, h in c["by_width"]]
        held += [r["within"]] if r else []
    above = [h for is_above, h in seen if is_above]
    print(json.dumps({"light": a.light, "members": len(poses), "pose_worst": round(max(poses, default=0), 4), "within": [round(min(held, default=0), 3), round(float(np.mean(held or [0])), 3)],
                      "recall": round(hits[0] / max(1, hits[1]), 3), "precision": round(trues[0] / max(1, trues[1]), 3), "f1_by_member": [round(f, 3) for f in f1s],
                      "above_limit_found": round(float(np.mean(above or [0])), 3), "widths": widths(all_rows)}))
