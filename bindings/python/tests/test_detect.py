import json
import subprocess

import numpy as np
import pytest

import intrados


def drawn():
    """A disc of grainy concrete with a round pore and a crack, 0.1 mm a pixel."""
    y, x = np.mgrid[0:400, 0:400].astype(float)
    grey = np.where(np.hypot(x - 200, y - 200) < 180, 1.0, 0.0)
    grey[np.hypot(x - 260, y - 150) < 12] = 0.0
    course = 240 + 6 * np.sin(x / 23)
    grey[(np.abs(y - course) < 2) & (x > 90) & (x < 300)] = 0.0
    noise = np.random.default_rng(1).normal(0, 0.03, grey.shape)
    return (grey + noise * (grey > 0) + 0.005 * np.abs(noise)).clip(0).astype(np.float32)


@pytest.mark.parametrize("method", ["auto", "classical"])
def test_a_pore_and_a_crack_of_an_array_are_found(method):
    found = intrados.detect(drawn(), mm_per_pixel=0.1, method=method)
    largest = max(found.pores, key=lambda pore: pore.area_px)
    assert (largest.x_mm, largest.y_mm) == pytest.approx((26, 15), abs=0.5)
    assert largest.diameter_mm == pytest.approx(2.4, rel=0.15)
    assert (found.labels == largest.label).sum() == largest.area_px
    crack = max(found.cracks, key=lambda crack: crack.length_mm)
    assert crack.length_mm == pytest.approx(21, rel=0.25) and found.crack_mask.any()
    assert found.pixel_known and found.porosity.value > 0


def test_a_file_gives_what_the_command_says(program, tmp_path):
    grey = (drawn()[150:246, 200:296].clip(0, 1.5) * 160).astype(np.uint8)
    file = tmp_path / "slice.png"
    write_png(file, grey)
    command = [program, "detect", file, "--pixel-mm", "0.1", "--format", "json", "--quiet"]
    told = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)["slices"][0]
    found = intrados.detect(file, mm_per_pixel=0.1)
    assert (found.porosity.value, found.porosity.std_error) == (told["porosity"], told["porosity_std_error"])
    assert (len(found.pores), len(found.cracks)) == (told["pores"], told["cracks"])
    same = intrados.detect(grey, mm_per_pixel=0.1)
    assert same.porosity == found.porosity and (same.labels == found.labels).all()


def test_what_is_no_slice_is_refused():
    with pytest.raises(ValueError, match="rows and columns"):
        intrados.detect(np.zeros((4, 4, 3)))
    with pytest.raises(ValueError, match="row 1, column 2 of the image is no number"):
        image = np.ones((4, 4))
        image[1, 2] = np.nan
        intrados.detect(image)
    with pytest.raises(intrados.InputError, match="no body found"):
        intrados.detect(np.zeros((32, 32)), mm_per_pixel=0.1)
    with pytest.raises(intrados.MissingError, match="nowhere.tif: No such file"):
        intrados.detect("nowhere.tif")


def write_png(path, grey):
    import struct
    import zlib

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    rows = b"".join(b"\0" + row.tobytes() for row in grey)
    head = struct.pack(">IIBBBBB", grey.shape[1], grey.shape[0], 8, 0, 0, 0, 0)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))
