"""The report of a crash tells where it happened, and nothing about the user."""

import os
import platform

import pytest
from calmotion.cli.diagnostics.crash_report import KEPT, crash, report_text, reported, write_crash_report
from calmotion.host import HostError, parse_quantity
from calmotion.workflow.problems import Problem

COMMAND = ["optimize", "/home/anna/Secret/Hero.usda", "-o", "Hero_calm.usda", "--csv", r"C:\Users\anna\x.csv",
           "--set", "usd.write.bake=motors", "--set", "bvh.read.map=/home/anna/map.toml", "--tolerance", "1mm",
           "--settings=../Secret/farm.toml", "--figures", "Secret"]  # fmt: skip


def raised(message="'/Hero/arm_L' of /home/anna/Secret/Hero.usda has no bone", function=None):
    try:
        try:
            parse_quantity(None, "m") if function is None else function()
        except Exception as cause:
            raise RuntimeError(message) from cause
    except RuntimeError as error:
        return error


def test_a_report_has_no_private_names(monkeypatch):
    monkeypatch.setenv("USER", "anna")
    text = report_text(raised(f"anna at {platform.node()}: " + str(raised())), COMMAND)
    for word in ("anna", "Secret", "Hero", "arm_L", "farm", os.path.expanduser("~") + "/", "/tests/"):
        assert word not in text, (word, text)
    assert platform.node() not in text or len(platform.node()) < 3


def test_a_report_tells_versions_command_and_frames():
    text = report_text(raised(), COMMAND)
    assert "optimize <path 1>.usda -o <path 2>.usda" in text and "--set usd.write.bake=motors" in text
    assert "--tolerance 1mm" in text and "bvh.read.map=<path 4>.toml" in text
    assert "'<path 7>' of <path 1>.usda has no bone" in text, "the same path has the same number"
    assert "calmotion/host/units.py:" in text and "<elsewhere>/test_crash_report.py:" in text
    assert text.index("calmotion/host/units.py:") < text.index("which led to:") < text.index("RuntimeError: ")
    assert f"numpy {__import__('numpy').__version__}" in text


def test_reports_lie_in_the_cache_folder_and_old_ones_go(tmp_path, monkeypatch):
    monkeypatch.setenv("CALMOTION_CACHE", str(tmp_path))
    (tmp_path / "crashes").mkdir()
    for day in range(10, 10 + KEPT + 3):
        (tmp_path / "crashes" / f"crash-202001{day}-000000-1.txt").write_text("")
    path = write_crash_report(raised(), COMMAND)
    names = sorted(found.name for found in path.parent.iterdir())
    assert path.parent == tmp_path / "crashes" and len(names) == KEPT and names[-1] == path.name


def test_a_report_lies_elsewhere_where_there_is_no_cache(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("CALMOTION_CACHE", str(tmp_path / "file"))
    path = write_crash_report(raised(), COMMAND)
    assert path is not None and path.is_file()
    path.unlink()


def test_the_command_line_tells_in_one_line_where_the_report_lies(tmp_path, monkeypatch, calmotion):
    monkeypatch.setenv("CALMOTION_CACHE", str(tmp_path))
    monkeypatch.setattr("calmotion.support.caching.caches.entries", lambda name: [][1])
    done = calmotion("cache", "info")
    (report,) = (tmp_path / "crashes").iterdir()
    assert done.returncode == 1 and str(report) in done.stderr and "Traceback" not in done.stderr
    assert "IndexError" in report.read_text() and "calmotion/cli/commands/setup/cache.py" in report.read_text()


def test_a_fault_of_a_bundled_operator_is_reported_and_that_of_another_plugin_is_shown(tmp_path, monkeypatch):
    monkeypatch.setenv("CALMOTION_CACHE", str(tmp_path))

    def problem(error):
        host_error = HostError("the operator fe.mesh of the plugin fe_mesher raised")
        host_error.__cause__ = error
        return Problem(host_error, "fe.mesh", "fe_mesher", "Traceback ...")

    try:
        parse_quantity(None, "m")
    except Exception as error:
        ours = error.with_traceback(error.__traceback__.tb_next)
    found = reported(problem(ours))
    assert found.traceback == "" and str(tmp_path) in found.error.remedy and found.operator == "fe.mesh"
    foreign = problem(raised())
    assert reported(foreign) is foreign


@pytest.mark.parametrize("error", [ValueError(), ValueError("x")])
def test_the_error_of_a_crash_says_what_was_raised(tmp_path, monkeypatch, error):
    monkeypatch.setenv("CALMOTION_CACHE", str(tmp_path))
    assert str(crash(error, []).found).startswith("ValueError")
