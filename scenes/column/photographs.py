"""Makes the two photographs of scenes/column.evidence.ron. They are rendered, not taken: the scene with what it plants, boards on the concrete that
the scene itself does not know, a lens that darkens towards the corners, the noise of a sensor, JPEG.

    pip install pillow numpy OpenEXR
    python3 scenes/column/photographs.py target/release/intrados"""
import math, pathlib, subprocess, sys, tempfile
import numpy as np
import OpenEXR
from PIL import Image

HERE = pathlib.Path(__file__).resolve().parent
WIDTH, HEIGHT, FOCAL = 900, 1400, 1400
# Member, face, from where, whither, and what is picked: corners at the foot and marks of a tape on the same edges.
SHOTS = [
    ("C2", "front", (2.3, 0.85, 3.0), (1.72, 0.7, 1.45), [(1.5, 1.5), (1.9, 1.5), (1.9, 1.1)]),
    ("C4", "right", (3.4, 0.85, -1.05), (1.85, 0.7, -1.68), [(1.9, -1.5), (1.9, -1.9), (1.5, -1.5)]),
]
MARKS = (0.0, 1.3)
FINISH = 'finish: Some((kind: Board, seed: 11, worn: 0.4))'


def project(position, target, place):
    forward = np.subtract(target, position) / np.linalg.norm(np.subtract(target, position))
    right = np.cross(forward, [0, 1, 0])
    right /= np.linalg.norm(right)
    to = np.subtract(place, position)
    depth = to @ forward
    return [WIDTH / 2 + FOCAL * (to @ right) / depth, HEIGHT / 2 - FOCAL * (to @ np.cross(right, forward)) / depth]


def taken(light, rng):
    """The file of a camera whose brightest hundredth burns out nearly."""
    rows, columns = np.mgrid[:HEIGHT, :WIDTH]
    r2 = ((columns - WIDTH / 2) ** 2 + (rows - HEIGHT / 2) ** 2) / (WIDTH / 2) ** 2
    light = light * (1 - 0.012 * r2)[..., None] * [1.06, 1, 0.93]
    light *= 0.8 / np.percentile(light, 99)
    light = (light + rng.normal(size=light.shape) * np.sqrt(1e-6 + 1e-4 * light.clip(0))).clip(0, 1)
    return (255 * np.where(light < 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055) + 0.5).astype(np.uint8)


def main(program):
    rng = np.random.default_rng(1)
    text = (HERE.parent / "column.ron").read_text()
    plain = '(name: "column concrete", colour: (0.46, 0.45, 0.43))'
    assert plain in text
    text = text.replace(plain, plain[:-1] + f", {FINISH})")
    fov = math.degrees(2 * math.atan(WIDTH / 2 / FOCAL))
    cameras = "".join(f'(name: "{m}", position: {p}, target: {t}, fov_deg: {fov}, width: {WIDTH}, height: {HEIGHT}, exposure: 0),' for m, _, p, t, _ in SHOTS)
    text = text.replace("cameras: [", "cameras: [" + cameras)
    with tempfile.TemporaryDirectory() as folder:
        scene = pathlib.Path(folder) / "scene.ron"
        scene.write_text(text)
        for member, face, position, target, edges in SHOTS:
            subprocess.run([program, "render", scene, "--camera", member, "--planted", "--spp", "128", "--out", f"{folder}/{member}", "--quiet"], check=True, stdout=subprocess.DEVNULL)
            exr = next(pathlib.Path(folder, member).glob("*.exr"))
            channels = OpenEXR.File(str(exr)).channels()
            light = channels["RGB"].pixels if "RGB" in channels else np.stack([channels[c].pixels for c in "RGB"], -1)
            exif = Image.Exif()
            exif[0x010E] = "Rendered by Intrados"
            exif.get_ifd(0x8769)[0xA405] = round(FOCAL * 43.27 / math.hypot(WIDTH, HEIGHT))
            name = HERE / f"{member}_{face}"
            Image.fromarray(taken(np.asarray(light, float), rng)).save(f"{name}.jpg", quality=85, exif=exif)
            rows = ["u,v,x,y,z"]
            for x, y, z in [(x, y, z) for y in MARKS for x, z in edges]:
                u, v = project(position, target, (x, y, z)) + rng.normal(size=2)
                assert 0 < u < WIDTH and 0 < v < HEIGHT, (member, x, y, z, u, v)
                rows.append(f"{u:.1f},{v:.1f},{x},{y},{z}")
            pathlib.Path(f"{name}.csv").write_text("\n".join(rows) + "\n")


if __name__ == "__main__":
    main(*sys.argv[1:])
