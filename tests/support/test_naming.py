from calmotion.support.naming import distinct_names


def test_paths_are_shortened_to_their_last_distinct_parts():
    names = distinct_names(["/R/left/hand", "/R/right/hand", "/R/head"])
    assert names == {"/R/left/hand": "left/hand", "/R/right/hand": "right/hand", "/R/head": "head"}


def test_a_path_that_ends_like_all_of_another_stays_distinct():
    names = distinct_names(["/hand", "/left/hand"])
    assert len(set(names.values())) == 2
