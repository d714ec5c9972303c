import json
import subprocess

import pytest

import intrados

# What a clock says, which no two runs have alike.
CLOCK = {"cpu_seconds", "own_cpu_seconds", "training_cpu_seconds", "setup_cpu_seconds", "figure_of_merit"}


def without_clock(told):
    if isinstance(told, dict):
        return {key: without_clock(value) for key, value in told.items() if key not in CLOCK}
    return [without_clock(one) for one in told] if isinstance(told, list) else told


def test_readings_have_the_bits_of_the_command(program, column, scene):
    command = [program, "measure", column.name, "--sensor", "C1 front", "--spp", "2", "--guide", "off"]
    told = subprocess.run(
        [*command, "--format", "json", "--quiet"], cwd=column.parent, check=True, capture_output=True, text=True
    ).stdout
    measurement = scene.measure("C1 front", spp=2, guide="off")
    assert without_clock(measurement.data) == without_clock(json.loads(told))
    reading = measurement["C1 front"]
    assert reading.mean > 0 and reading.primal and reading.dual and measurement.stop == "spp"


def test_a_sensor_that_is_not_there_is_refused_with_those_that_are(scene):
    with pytest.raises(intrados.UsageError, match='no camera or meter "C9": there are .*C1 front'):
        scene.measure("C9")
