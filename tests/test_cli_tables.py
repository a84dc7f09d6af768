from calmotion.cli_tables import name_paths


def test_short_paths_stay_whole():
    assert name_paths(["/A/b", "/A/c"]) == {"/A/b": "/A/b", "/A/c": "/A/c"}


def test_long_paths_are_named_by_as_few_last_names_as_tell_them_apart():
    deep = "/Robot/" + "link/" * 20
    names = name_paths([deep + "left/hand", deep + "right/hand", deep + "head"])
    assert sorted(names.values()) == ["head", "left/hand", "right/hand"]
