import pytest

import intrados


def test_a_life_has_steps_peaks_and_fields(scene):
    analysis = scene.analyze("C1", element=0.4)
    life = analysis.member("C1")
    assert life.time_s.shape == life.max_displacement_m.shape and (life.time_s[1:] >= life.time_s[:-1]).all()
    assert life.converged.all() and not life.complaint
    # 1600 kN on 0.16 m² that 12 bars of 20 mm help to bear.
    assert -1600e3 / 0.16 * 2 < life.peak_compression_pa < -0.4 * 1600e3 / 0.16
    field = analysis.field("C1")
    assert field["nodes"].shape == field["displacement_m"].shape and field["stress_pa"].shape[1] == 6
    largest = (field["displacement_m"] ** 2).sum(axis=1).max() ** 0.5
    assert largest == pytest.approx(life.max_displacement_m[-1], rel=1e-6)


STUB = """(
    schema: "intrados.scene/1",
    members: [(id: "S", at: (0, 0, 0), concrete: "C30/37", body: Column(section: Rectangle(width_m: 0.2, depth_m: 0.2), height_m: 0.4))],
    supports: [(member: "S", place: Start, hold: Directions(x: true, y: true, z: true))],
    loads: [(name: "jack", action: Force(place: End, force_kn: (0, -100, 0)), history: [(28, 0), (29, 1)])],
)
"""


@pytest.fixture(scope="module")
def stub(tmp_path_factory):
    """Plain concrete, pressed evenly."""
    path = tmp_path_factory.mktemp("stub") / "stub.ron"
    path.write_text(STUB)
    return intrados.load(path)


@pytest.mark.parametrize("to_failure", [True, "jack"])
def test_loads_are_raised_until_a_member_fails(stub, to_failure):
    strength = stub.analyze(to_failure=to_failure).member("S").strength
    # A f_cm = 0.04 m² · 38 MPa.
    assert strength.peak.load_n == pytest.approx(0.04 * 38e6, rel=0.05)
    assert strength.load_n.max() == strength.peak.load_n == pytest.approx(100e3 * strength.peak.load_factor)
    assert strength.displacement_m.shape == strength.load_n.shape == strength.load_factor.shape
    assert strength.loads == ("jack",) and strength.mode != "None" and strength.yielding is None
    assert stub.analyze().member("S").strength is None


def test_what_a_member_bears_is_predicted(stub):
    member = stub.predict(strength=True).member("S")
    bears = member.capacity
    assert bears.loads == ("jack",) and 0 < bears.load_factor.std_error < bears.load_factor.value <= bears.sound + 1e-9
    assert not member.by_strength and stub.predict().member("S").capacity is None


def test_a_stretch_is_of_one_member_and_not_raised(scene):
    life = scene.analyze("C1", element=0.4, fine=(0.4, 0.6)).member("C1")
    assert life.converged.all() and life.strength is None
    with pytest.raises(intrados.UsageError, match="--fine"):
        scene.analyze("C1", fine=(0.4, 0.6), to_failure=True)
