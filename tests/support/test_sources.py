"""Hashes of sources: they change with every module that is imported, directly or not."""

import calmotion
import pytest
from calmotion.support.caching.bundled_kernels import PACKAGE, digest_of, source_digest, with_imports


@pytest.fixture
def package(tmp_path):
    """A package of four modules; `d` is imported by none."""
    root = tmp_path / "calmotion"
    (root / "room").mkdir(parents=True)
    (root / "a.py").write_text("from calmotion.room import (\n    b,\n)\n")
    (root / "room" / "__init__.py").write_text("")
    (root / "room" / "b.py").write_text("def f():\n    from calmotion.c import X\n    return X\n")
    (root / "c.py").write_text("X = 1\n")
    (root / "d.py").write_text("Y = 1\n")
    return root


def test_imports_are_followed_through_folders_and_functions(package):
    found = with_imports([package / "a.py"], package.parent)
    assert {str(path.relative_to(package)) for path in found} == {"a.py", "room/__init__.py", "room/b.py", "c.py"}


def test_a_class_is_no_module_where_file_names_have_no_capitals(package, monkeypatch):
    """Else the kernels of such a system have other keys than those that a wheel brings."""
    exact = type(package).is_file
    monkeypatch.setattr(type(package), "is_file", lambda path: exact(path.with_name(path.name.lower())))
    (package / "x.py").write_text("X = 1\n")  # beside the class X of c
    (package / "a.py").write_text("from calmotion import X\nfrom calmotion.c import X\n")
    assert package / "X.py" not in with_imports([package / "a.py"], package.parent)


def test_a_hash_changes_with_content_and_name(package):
    one = digest_of([package / "c.py"])
    assert one != digest_of([package / "d.py"])
    (package / "c.py").write_text("X = 2\n")
    assert one != digest_of([package / "c.py"])


def test_the_digest_of_a_room_is_that_of_its_sources():
    """A digest of nothing would let caches outlive the code that made them."""
    from pathlib import Path

    package = Path(calmotion.__file__).parent
    assert PACKAGE == package
    room = sorted((package / "reduction").rglob("*.py"))
    assert len(room) > 10 and source_digest("reduction") == digest_of(room)
    solver = package / "multibody" / "integrators" / "newton.py"
    assert package / "multibody" / "kernels" / "assembly.py" in with_imports([solver])
