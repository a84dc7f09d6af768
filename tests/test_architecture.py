"""The rooms of the package: imports go down the floors and never up, and no circle of modules. Nothing needs a
plugin that can be deleted (docs/architecture.md).

All imports count: those inside functions, and those for type checkers.
"""

import ast
import re
import textwrap
from collections.abc import Iterator
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest
from floors import FLOORS, MEASURED, optional_plugins

PACKAGE = Path(__file__).resolve().parents[1] / "pipeline" / "calmotion"
PLUGINS = PACKAGE.parents[1] / "plugins"
TESTS = Path(__file__).resolve().parent

FLOOR = {room: floor for floor, rooms in enumerate(FLOORS) for room in rooms}
MODULES_OF_A_FOLDER = 14
LINES_OF_A_MODULE = 350
LINES_OF_A_FUNCTION = 80
PARAMETERS_OF_A_FUNCTION = 10
SAMPLES = PACKAGE.parents[1] / "samples"


def name_of(path: Path) -> str:
    """The module of a file."""
    parts = path.relative_to(PACKAGE.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULES = {name_of(path): path for path in sorted(PACKAGE.rglob("*.py"))}


@cache
def tree(path: Path) -> ast.Module:
    """The parsed source of a module."""
    return ast.parse(path.read_text())


@cache
def homes(package: str) -> dict[str, str]:
    """Public names of a package to the modules that define them, as its stub says."""
    stub = MODULES[package].with_suffix(".pyi")
    if MODULES[package].name != "__init__.py" or not stub.is_file():
        return {}
    imports = [node for node in ast.parse(stub.read_text()).body if isinstance(node, ast.ImportFrom)]
    return {alias.name: node.module or "" for node in imports for alias in node.names}


def imports_of(module: str) -> Iterator[str]:
    """The modules of the package that a module imports, anywhere in its source; public names count as their homes."""
    path = MODULES[module]
    package = module.split(".") if path.name == "__init__.py" else module.split(".")[:-1]
    for node in ast.walk(tree(path)):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name in MODULES)
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else []
            source = ".".join([*base, *([node.module] if node.module else [])])
            public = homes(source) if source in MODULES else {}
            for alias in node.names:
                full = f"{source}.{alias.name}"
                if alias.name in public:
                    yield public[alias.name]
                elif full in MODULES or source in MODULES:
                    yield full if full in MODULES else source


@cache
def imports() -> dict[str, set[str]]:
    """The imports of every module of the package."""
    return {module: {name for name in imports_of(module) if name != module} for module in MODULES}


def room_of(module: str) -> str:
    """The room that a module lies in; the package itself offers the interface and the version."""
    parts = module.split(".")
    return parts[1] if len(parts) > 1 else ""


def test_every_room_stands_on_a_floor():
    rooms = {room_of(module) for module in MODULES} - {""}
    assert rooms <= set(FLOOR), f"name the floor of {rooms - set(FLOOR)}"


@pytest.mark.parametrize("room", sorted(FLOOR))
def test_imports_never_go_up(room):
    up = [
        f"{module} imports {other}"
        for module, others in imports().items()
        for other in sorted(others)
        if room_of(module) == room and room_of(other) not in ("", room) and FLOOR[room_of(other)] >= FLOOR[room]
    ]
    assert not up


def test_no_circle_of_modules():
    try:
        TopologicalSorter(imports()).prepare()
    except CycleError as circle:
        pytest.fail(" -> ".join(circle.args[1]))


def test_the_engine_imports_neither_usd_nor_rerun():
    found = [
        f"{module} imports {name}"
        for module, path in MODULES.items()
        if room_of(module) != "usd"
        for node in ast.walk(tree(path))
        for name in ([a.name for a in node.names] if isinstance(node, ast.Import) else [getattr(node, "module", None)])
        if isinstance(node, ast.Import | ast.ImportFrom) and name and name.split(".")[0] in ("pxr", "rerun")
    ]
    assert not found


def test_plugins_import_public_packages_alone():
    """`calmotion`, `calmotion.model`, ...: at most one level deep, as a studio's own plugin would."""
    deep = [
        f"{path.relative_to(PLUGINS)}:{node.lineno}: {name}"
        for path in sorted(PLUGINS.rglob("*.py"))
        for node in ast.walk(tree(path))
        for name in names_of_import(node)
        if name.startswith("calmotion.") and (name.count(".") > 1 or name not in MODULES)
    ]
    assert not deep


def names_of_import(node: ast.AST) -> list[str]:
    """The modules that a statement imports by their full names; of `from calmotion.a import module`, that module."""
    if isinstance(node, ast.Import):
        return [alias.name for alias in node.names]
    if not isinstance(node, ast.ImportFrom) or node.level or node.module is None:
        return []
    modules = [f"{node.module}.{alias.name}" for alias in node.names]
    public = homes(node.module) if node.module in MODULES else {}
    return [name if name in MODULES and name.rsplit(".", 1)[1] not in public else node.module for name in modules]


def plugins_of(path: Path) -> set[str]:
    """The bundled plugins whose modules a file imports, or names in a text, as for `import_module`.

    A helper of the tests of a plugin counts as the plugin. The modules of `pytest.importorskip` do not count: the test
    is skipped where the plugin is deleted.
    """
    package = ["calmotion_plugins", *path.relative_to(PLUGINS).parts[:-1]] if path.is_relative_to(PLUGINS) else []
    if not package and not re.search(rf"\bcalmotion_plugins\b|\b({'|'.join(HELPERS)})\b", path.read_text()):
        return set()
    nodes = list(ast.walk(tree(path)))
    calls = [node for node in nodes if isinstance(node, ast.Call) and getattr(node.func, "attr", "") == "importorskip"]
    skipped = {argument for call in calls for argument in call.args}
    imported, texts = [], []
    for node in nodes:
        if isinstance(node, ast.Import):
            imported += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else []
            imported += [".".join([*base, *filter(None, [node.module]), alias.name]) for alias in node.names]
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and node not in skipped:
            texts.append(node.value)
    helpers = {name.partition(".")[0] for name in imported} & set(HELPERS)
    named = re.findall(r"\bcalmotion_plugins\.(\w+)", "\n".join([*imported, *texts]))
    return {*named, *(HELPERS[name] for name in helpers)}


def is_part(path: Path, plugin: str) -> bool:
    """Whether a file is of a plugin or its tests, or of those of a plugin that measures it where it is there."""
    names = {plugin, *(other for other, measured in MEASURED.items() if plugin in measured)}
    folders = [root / name for root in (PLUGINS, TESTS / "plugins", TESTS / "helpers") for name in names]
    return path == TESTS / "plugins" / f"test_{plugin}.py" or any(path.is_relative_to(folder) for folder in folders)


OPTIONAL = optional_plugins(PLUGINS)
HELPERS = {path.stem: name for name in OPTIONAL for path in (TESTS / "helpers" / name).glob("*.py")}


@cache
def files() -> dict[Path, set[str]]:
    """The optional plugins that each file imports."""
    return {path: plugins_of(path) for root in (PACKAGE, PLUGINS, TESTS) for path in sorted(root.rglob("*.py"))}


@pytest.mark.parametrize("plugin", OPTIONAL)
def test_only_an_optional_plugin_itself_and_its_tests_import_it(plugin):
    users = [str(path) for path, plugins in files().items() if plugin in plugins and not is_part(path, plugin)]
    assert not users


def test_every_way_to_name_a_plugin_is_seen(tmp_path, monkeypatch):
    monkeypatch.setitem(globals(), "PLUGINS", tmp_path)
    source = """
        import calmotion_plugins.one.inner
        from calmotion_plugins import two, three
        from calmotion_plugins.four import thing
        import_module("calmotion_plugins.five.inner")
        from ...six import thing
        from ... import seven
        from ..own import thing
        pytest.importorskip("calmotion_plugins.eight")
    """
    file = tmp_path / "mine" / "room" / "module.py"
    file.parent.mkdir(parents=True)
    file.write_text(textwrap.dedent(source))
    assert plugins_of(file) == {"one", "two", "three", "four", "five", "six", "seven", "mine"}


def test_folders_and_modules_stay_small():
    folders = {path.parent for root in (PACKAGE, PLUGINS) for path in root.rglob("*.py")}
    crowded = {str(f): n for f in folders if (n := len(list(f.glob("*.py")))) > MODULES_OF_A_FOLDER}
    assert not crowded
    sources = [path for root in (PACKAGE, PLUGINS) for path in root.rglob("*.py")]
    long = {str(path): n for path in sources if (n := len(path.read_text().splitlines())) > LINES_OF_A_MODULE}
    assert not long


def parameters_of(function: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    """Number of parameters, without the instance or class of a method."""
    given = function.args
    names = [*given.posonlyargs, *given.args, *given.kwonlyargs]
    own = bool(names) and names[0].arg in ("self", "cls")
    return len(names) - own + (given.vararg is not None) + (given.kwarg is not None)


def without_reason(source: str) -> list[str]:
    """Functions over a limit without `# long: reason` or `# parameters: reason`, directly above or in the first lines.

    The first lines are those up to the first statement after the docstring.
    """
    lines, found = source.splitlines(), []
    for node in ast.walk(ast.parse(source)):
        if not isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            continue
        begin = min([node.lineno, *(decorator.lineno for decorator in node.decorator_list)])
        documented = len(node.body) > 1 and ast.get_docstring(node, clean=False) is not None
        first = node.body[documented].lineno
        comments = [lines[row].strip() for row in range(begin - 1, first)]
        above = begin - 2
        while above >= 0 and lines[above].strip().startswith("#"):
            comments.append(lines[above].strip())
            above -= 1
        assert node.end_lineno is not None
        over = {
            "# long: ": node.end_lineno - node.lineno + 1 > LINES_OF_A_FUNCTION,
            "# parameters: ": parameters_of(node) > PARAMETERS_OF_A_FUNCTION,
        }
        if any(large and not any(mark in line for line in comments) for mark, large in over.items()):
            found.append(node.name)
    return found


def test_functions_stay_small_or_give_a_reason():
    root = PACKAGE.parents[1]
    found = {
        f"{path.relative_to(root).as_posix()}: {name}"
        for folder in (PACKAGE, PLUGINS, SAMPLES)
        for path in folder.rglob("*.py")
        for name in without_reason(path.read_text())
    }
    assert not found, "split them, or give the reason: `# long: ...`, `# parameters: ...`"


def test_a_reason_is_read_above_a_function_and_in_its_first_lines():
    names = ", ".join(f"p{k}" for k in range(11))
    body = '    """What it does."""\n' + "    x = 1\n" * 80
    assert without_reason(f"def f({names}):\n    pass\n") == ["f"]
    assert without_reason(f"# parameters: given by USD\n@d\ndef f({names}):\n    pass\n") == []
    assert without_reason(f"# long: one table\ndef f({names}):\n    pass\n") == ["f"], "the reason of another limit"
    assert without_reason(f"class A:\n    def f(self, {', '.join(names.split(', ')[1:])}):\n        pass\n") == []
    assert without_reason(f"def f():\n{body}") == ["f"]
    assert without_reason(body.join(["def f():\n", ""]).replace("    x", "    # long: one table\n    x", 1)) == []
    assert without_reason(f"def f():\n{body}    # long: too late\n    x = 2\n") == ["f"]


def test_one_module_knows_operating_systems():
    """Others name nothing that only some systems have: no Windows machine would tell."""
    own = PACKAGE / "support" / "operating_system.py"
    names = r"\bfcntl\b|\bimport resource\b|os\.(fork|getuid|geteuid|sched_\w+)\b|\bprctl\b"
    names += r"|signal\.SIG(KILL|XCPU|HUP|QUIT|ALRM)\b|[\"'](/dev|/tmp|/proc/meminfo)\b"
    sources = [path for root in (PACKAGE, PLUGINS) for path in root.rglob("*.py") if path != own]
    assert len(sources) > 500
    assert [str(path) for path in sources if re.search(names, path.read_text(encoding="utf-8"))] == []
