"""The doctor finds what is wrong and says what to do."""

import json
import re

import pytest
from calmotion.cli.commands import doctor
from calmotion.cli.commands.doctor import NOTE, OK, WRONG, examine


def by_name(findings):
    return {one.name: one for one in findings}


@pytest.fixture(scope="module")
def findings():
    return examine()


def test_everything_is_looked_at(findings):
    found = by_name(findings)
    wanted = ("calmotion", "Python", "plugins", "cache folder", "processor", "memory", "compiler", "rerun viewer")
    assert all(name in found for name in wanted), list(found)
    assert all(one.remedy for one in findings if one.state != OK)
    assert found["compiler"].state == OK and found["Python"].state == OK


def test_what_is_wrong_has_a_remedy(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("CALMOTION_CACHE", str(tmp_path / "file"))
    monkeypatch.setattr("calmotion.support.memory.available_memory", lambda: 1e8)
    monkeypatch.setattr(doctor.shutil, "which", lambda name, path=None: None)
    monkeypatch.setattr(doctor.metadata, "requires", lambda name: ["numpy<1", "nowhere>=1", "x ; extra == 'dev'"])
    found = by_name(examine())
    assert found["cache folder"].state == WRONG and "CALMOTION_CACHE" in found["cache folder"].remedy
    assert found["memory"].state == NOTE and found["rerun viewer"].state == NOTE
    assert found["numpy"].state == WRONG and "pip install" in found["numpy"].remedy
    assert found["nowhere"].state == WRONG and "x" not in found
    monkeypatch.setattr("numba.config.DISABLE_JIT", 1)
    assert "NUMBA_DISABLE_JIT" in by_name(examine())["compiler"].remedy


def test_a_look_that_fails_is_a_finding(monkeypatch):
    def broken():
        raise OSError("no such device")
        yield

    monkeypatch.setattr(doctor, "_memory", broken)
    assert "no such device" in by_name(examine())["broken"].found


def test_the_command_prints_findings_and_its_status(calmotion, monkeypatch, findings):
    monkeypatch.setattr(doctor, "examine", lambda: findings)
    done = calmotion("doctor", "--json")
    report = json.loads(done.stdout)
    assert len(report["findings"]) == len(findings) and done.returncode == int(report["wrong"] > 0)
    bad = [*findings, doctor.Finding("disk", WRONG, "full", "Free some space")]
    monkeypatch.setattr(doctor, "examine", lambda: bad)
    done = calmotion("doctor")
    assert done.returncode == 1 and re.search("wrong +disk +full +Free some space", done.stdout)
