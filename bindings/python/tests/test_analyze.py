import pytest


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
