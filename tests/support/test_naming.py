import pytest
from calmotion.support.naming import distinct_names, nearest


def test_paths_are_shortened_to_their_last_distinct_parts():
    names = distinct_names(["/R/left/hand", "/R/right/hand", "/R/head"])
    assert names == {"/R/left/hand": "left/hand", "/R/right/hand": "right/hand", "/R/head": "head"}


def test_a_path_that_ends_like_all_of_another_stays_distinct():
    names = distinct_names(["/hand", "/left/hand"])
    assert len(set(names.values())) == 2


JOINTS = ["/Arm/joints/shoulder", "/Arm/joints/elbow", "/Arm/left/wrist", "/Arm/right/wrist"]


@pytest.mark.parametrize(
    ("found", "meant"),
    [
        ("/Arm/joints/elbwo", "/Arm/joints/elbow"),
        ("/Arm/elbow", "/Arm/joints/elbow"),
        ("/Robot/Elbow", "/Arm/joints/elbow"),
        ("shoulde", "/Arm/joints/shoulder"),
        ("ELBOW", "/Arm/joints/elbow"),
        ("/Arm/rigth/wrist", "/Arm/right/wrist"),
        ("/Arm/left/wrists", "/Arm/left/wrist"),
    ],
)
def test_the_nearest_path_is_found_by_its_last_part(found, meant):
    assert nearest(found, JOINTS) == f"Did you mean {meant}? "


@pytest.mark.parametrize("found", ["/Arm/joints/gone", "/Arm/joints/x", "", "/"])
def test_nothing_is_suggested_where_no_name_is_like_it(found):
    assert nearest(found, JOINTS) == nearest(found, []) == ""


def test_words_are_compared_without_case():
    assert nearest("Zvd", ["zv", "zvd"]) == "Did you mean zvd? "
