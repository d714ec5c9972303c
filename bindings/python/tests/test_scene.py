import pathlib

import pytest

import intrados


def test_a_scene_says_what_is_in_it(scene):
    assert (scene.name, scene.title) == ("column", "A column")
    (member,) = scene.members
    assert (member.id, member.kind, member.concrete) == ("C1", "column", "C30/37")
    assert member.size == pytest.approx((0.4, 3.0, 0.4), abs=1e-6)
    assert (member.bars, scene.meters) == (12, ("C1 front",))
    assert scene.member("Column 1") is member
    with pytest.raises(KeyError, match="there are C1"):
        scene.member("C2")


def test_a_bundled_scene_and_a_path_are_both_taken(column):
    assert intrados.load("room").meters
    assert intrados.load(str(column)).hash == intrados.load(pathlib.Path(column)).hash


def test_an_error_is_the_line_of_the_program(tmp_path):
    with pytest.raises(intrados.MissingError, match=r"nowhere\.ron: there is no such file") as missing:
        intrados.load(tmp_path / "nowhere.ron")
    assert isinstance(missing.value, intrados.Error) and "\n" not in str(missing.value)
    wrong = tmp_path / "wrong.ron"
    wrong.write_text('(schema: "intrados.scene/1", lamps: [Sun])')
    with pytest.raises(intrados.InputError, match=r"wrong\.ron") as bad:
        intrados.load(wrong)
    assert isinstance(bad.value, ValueError)
