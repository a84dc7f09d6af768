import pytest
from calmotion.support.naming import as_written, distinct_names, grouped_notes, nearest


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


def test_a_part_of_a_name_means_the_shortest_that_contains_it():
    assert nearest("XM43", ["mx-64", "xm430-w350-r", "xm430-w210"]) == "Did you mean xm430-w210? "
    assert nearest("43", ["xm430-w210"]) == ""


def test_words_are_compared_without_case():
    assert nearest("Zvd", ["zv", "zvd"]) == "Did you mean zvd? "


@pytest.mark.parametrize(
    ("notes", "told"),
    [
        (["/a/b: it holds 3: still", "no scene: down", "/c: it holds 3: still", "/d: moves"],
         ["/a/b and c: it holds 3: still", "no scene: down", "/d: moves"]),
        ([f"/R/j{k}: effort limit from /R/Physics/act{k} (MuJoCo)" for k in range(7)],
         ["/R/j0, j1, j2 and 4 more: effort limit from /R/Physics/… (MuJoCo)"]),
        (["/a: removed an open sheet"] * 10, ["/a: removed an open sheet (10 times)"]),
        (["ignored /a/x, a copy of /b"] * 2 + ["ignored /a/y, a copy of /b"], ["ignored /a/…, a copy of /b (3 times)"]),
        ([f"/a{k}: still" for k in range(4)], ["/a0, a1, a2 and a3: still"]),
    ],
)  # fmt: skip
def test_notes_that_differ_in_their_prims_alone_are_one(notes, told):
    assert list(grouped_notes(notes)) == told


def test_encoded_names_are_told_as_the_author_of_the_file_wrote_them():
    names = {"tn__leftknee_uN9E": "left-knee"}
    assert as_written("/R/tn__leftknee_uN9E/x of tn__other_a1", names) == "/R/left-knee/x of tn__other_a1"
