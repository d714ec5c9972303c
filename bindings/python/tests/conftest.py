import os
import shutil
import subprocess

import pytest

import intrados

EVIDENCE = """(
    schema: "intrados.evidence/1",
    items: [
        (member: "C1", name: "crack 1", date: "2026-05-04", along: 0.35, face: Front, shows: Crack(width_mm: 0.6, course: Across, length_m: 0.4)),
        (member: "C1", name: "rebound 1", date: "2026-05-04", along: 0.45, face: Front, instrument: "type N", shows: Rebound(number: 43)),
    ],
)
"""


@pytest.fixture(scope="session")
def program():
    """The command line that the wheel is compared with."""
    program = os.environ.get("INTRADOS") or shutil.which("intrados")
    if program is None:
        pytest.skip("no command line to compare with: set INTRADOS")
    return program


@pytest.fixture(scope="session")
def column(tmp_path_factory, program):
    """The file of a column with two findings."""
    folder = tmp_path_factory.mktemp("scene")
    subprocess.run([program, "new", "column", "column.ron", "--quiet"], cwd=folder, check=True, capture_output=True)
    (folder / "column.evidence.ron").write_text(EVIDENCE)
    return folder / "column.ron"


@pytest.fixture(scope="session")
def scene(column):
    return intrados.load(column)
