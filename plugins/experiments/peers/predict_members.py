"""Do the intervals of predictions from photographs hold the truth? Members of members.py, predicted from their one photograph alone.

    python3 predict_members.py OUT [--intrados target/release/intrados]

Truth is what was planted, by the program's own rule for findings (question.py), zone by zone: a zone has the worst crack that passes it.
One JSON line a member and one of all: of zones that the photograph shows and of members the share whose 95 % interval holds the truth."""
import argparse, glob, json, os, subprocess
import numpy as np
import question, score_members as score

H, ZONES = 0.36, 10


def planted(truth):
    """Damage by zone."""
    zones = [0.0] * ZONES
    for crack, (width, length, along) in zip(truth["cracks"], question.planted(truth)):
        lost = question.damage([(width, length, along)])
        y = score.points(crack)[0][:, 1] / H * ZONES
        for zone in range(max(0, int(y.min())), min(ZONES - 1, int(y.max())) + 1):
            zones[zone] = max(zones[zone], lost)
    return zones


def predict(program, folder):
    kept = f"{folder}/predicted.json"
    if not os.path.exists(kept):
        with open(f"{folder}/scene.evidence.ron", "w") as out:
            out.write('(schema: "intrados.evidence/1", photographs: [(file: "photo.jpg", picks: "picks.csv", member: "M", name: "photo", focal_px: Some(1800))])')
        words = [program, "predict", f"{folder}/scene.ron", "--no-forecast", "--spp", "1", "--out", f"{folder}/predicted", "--format", "json", "--quiet"]
        done = subprocess.run(words, capture_output=True, text=True)
        os.remove(f"{folder}/scene.evidence.ron")
        with open(kept, "w") as out:
            out.write(done.stdout if done.returncode == 0 else json.dumps({"error": done.stderr.strip()}))
    return json.load(open(kept))


if __name__ == "__main__":
    a = argparse.ArgumentParser()
    a.add_argument("out"); a.add_argument("--intrados", default="target/release/intrados")
    a = a.parse_args()
    members, zones = [], []
    for folder in sorted(glob.glob(f"{a.out}/[0-9]*"), key=lambda p: int(p.rsplit("/", 1)[1])):
        truth, said = json.load(open(f"{folder}/truth.json")), predict(a.intrados, folder)
        m = said["members"][0] if said.get("members") else None
        if m is None or m["damage"] is None:
            print(json.dumps({"member": folder, "unused": said.get("error", [i.get("why") for i in said.get("items", [])])})); continue
        true = planted(truth)
        holds = lambda value, error, t: abs(value - t) <= 1.96 * max(error, 0.005)
        here = [holds(z["value"], z["std_error"], t) for z, t in zip(m["zones"], true) if z is not None]
        members.append(holds(m["damage"], m["damage_std_error"], max(true))); zones += here
        print(json.dumps({"member": folder, "light": truth["light"], "damage": [round(m["damage"], 3), round(m["damage_std_error"], 3)], "truth": round(max(true), 3), "zones_held": [sum(here), len(here)], "faces": [[f["face"], round(f["seen"], 2)] for f in m.get("faces", [])]}), flush=True)
    print(json.dumps({"members_held": [int(sum(members)), len(members)], "zones_held": [int(sum(zones)), len(zones)]}))
