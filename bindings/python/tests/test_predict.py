import json
import subprocess

import numpy as np
import pytest

import intrados


def without_files(text):
    """What does not depend on where files are written."""
    head, _, _ = text.partition('\n  "files": [')
    assert head != text
    return head


@pytest.mark.parametrize("forecast", [False, True])
def test_a_prediction_has_the_bits_of_the_command(program, column, scene, tmp_path, forecast):
    options = ["--element", "0.4"] if forecast else ["--no-forecast"]
    command = [program, "predict", column.name, "--spp", "0", "--out", tmp_path, "--format", "json", "--quiet", *options]
    told = subprocess.run(command, cwd=column.parent, check=True, capture_output=True, text=True).stdout
    prediction = scene.predict(forecast=forecast, element=0.4 if forecast else None)
    assert without_files(prediction.json()) == without_files(told)


def test_a_prediction_is_typed(scene):
    seen = []
    prediction = scene.predict(forecast=False, progress=lambda share, label: seen.append((share, label)))
    c1 = prediction.member("C1")
    assert 0 < c1.damage < 1 and c1.std_error > 0
    assert c1.basis == "measured" and [e.source for e in c1.evidence] == ["survey"]
    assert len(c1.zones) == 10 and c1.zones[3].damage == max(z.damage for z in c1.zones if z.damage is not None)
    value, error = prediction.damage()
    assert value.shape == error.shape == (1, 10) and np.nanmax(value) == c1.zones[3].damage
    assert prediction.scene_hash == scene.hash and prediction.data == json.loads(prediction.json())
    assert all(0 <= share <= 1 and isinstance(label, str) for share, label in seen)


def test_the_report_is_where_it_was_asked_for_or_goes_with_the_prediction(scene, tmp_path):
    kept = scene.predict(forecast=False, out=tmp_path / "out")
    assert (tmp_path / "out" / "report.html").is_file() and kept.html().startswith("<!")
    passing = scene.predict(forecast=False)
    files = passing.files
    assert all(file.is_file() for file in files)
    del passing
    assert not any(file.exists() for file in files)


def test_a_wrong_argument_is_refused_in_a_line(scene):
    with pytest.raises(intrados.UsageError, match="--ahead") as refused:
        scene.predict(ahead=-1)
    assert "\n" not in str(refused.value)
