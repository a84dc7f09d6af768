"""Options of the tempo: what they mean for the search, and what is refused."""

import argparse

import pytest
from calmotion.cli.retiming import refuse_unused_retiming, retime_options, retime_settings
from calmotion.host import SettingError


def parsed(*arguments):
    parser = argparse.ArgumentParser()
    retime_options(parser)
    parser.set_defaults(set=[])
    return parser.parse_args(arguments)


def test_a_tempo_is_settings_of_the_search(tmp_path):
    assert retime_settings(parsed()) == {}
    assert retime_settings(parsed("--retime")) == {"retime": True}
    found = retime_settings(parsed("--retime", "slowest=1.5,fastest=0.9,pin=24,48,72s"))
    assert found == {"retime": True, "slowest": 1.5, "fastest": 0.9, "pinned": "24,48,72s"}


@pytest.mark.parametrize(
    ("text", "pinned"),
    [("beat,time_s\n1,0.5\n2,1.0\n", "0.5s,1s"), ("time_code\n24\n48\n", "24,48"), ("24\n48\n", "24,48")],
)
def test_pinned_times_come_from_a_table(tmp_path, text, pinned):
    path = tmp_path / "beats.csv"
    path.write_text(text)
    assert retime_settings(parsed("--retime", "--pin", str(path))) == {"retime": True, "pinned": pinned}
    with pytest.raises(SettingError, match="Add --retime"):
        refuse_unused_retiming(parsed("--pin", str(path)))


@pytest.mark.parametrize("text", ["slower=2", "slowest=much", "24,48", "fastest"])
def test_what_means_no_tempo_is_refused(text, capsys):
    with pytest.raises(SystemExit):
        parsed("--retime", text)
    assert "slowest" in capsys.readouterr().err


def test_a_table_without_times_is_refused(tmp_path, capsys):
    path = tmp_path / "beats.csv"
    path.write_text("a,b\n1,2\n")
    with pytest.raises(SystemExit):
        parsed("--retime", "--pin", str(path))
    assert "time_code" in capsys.readouterr().err
