"""What messages tell to do can be done: options, settings and commands that they name exist, and help."""

import ast
import contextlib
import io
import re

import numpy as np
import pytest
from calmotion.cli.main import main
from calmotion.host import open_host
from one_hinge import ONE_HINGE

OPTION, COMMAND = re.compile(r"(?<![\w-])--[a-z][a-z-]*[a-z]"), re.compile(r"(?<![\w/.-])calmotion ([a-z]+)\b")
SETTING = re.compile(r"--set ([a-z_]+\.[a-z_]+\.[a-z_]+)|--set ([a-z_]+\.[a-z_]+)=")
SETTINGS = re.compile(r"--set [\w.]+=\S+")
# Commands of other programs that messages name.
FOREIGN = {"--editable", "--user", "--upgrade", "--extra-index-url", "--break-system-packages"}


@pytest.fixture(scope="module")
def texts(repository):
    """Every text of the product that is no docstring, with its place; pieces of formatted ones by themselves."""
    found = []
    for path in sorted([*(repository / "pipeline").rglob("*.py"), *(repository / "plugins").rglob("*.py")]):
        if "blender" in path.parts:
            continue
        tree = ast.parse(path.read_text())
        bare = {id(n.value) for n in ast.walk(tree) if isinstance(n, ast.Expr)}
        found += [
            (f"{path.name}:{n.lineno}", n.value) for n in ast.walk(tree)
            if isinstance(n, ast.Constant) and isinstance(n.value, str) and id(n) not in bare
        ]  # fmt: skip
    return found


def help_of(*words):
    with contextlib.redirect_stdout(io.StringIO()) as out, contextlib.suppress(SystemExit):
        main([*words, "--help"])
    return out.getvalue()


@pytest.fixture(scope="module")
def commands():
    """The help of each command, by name."""
    listed = re.findall(r"^  ([a-z]+) {2,}", help_of(), re.MULTILINE)
    return {name: help_of(name) for name in listed}


def test_options_and_commands_that_messages_name_exist(texts, commands):
    benchmarks = re.findall(r"^ +([a-z]+(?:-[a-z]+)*) {2,}", commands["bench"], re.MULTILINE)
    pages = [help_of(), help_of("cache", "prune"), *commands.values(), *(help_of("bench", name) for name in benchmarks)]
    known = {option for page in pages for option in OPTION.findall(page)} | FOREIGN
    known |= {f"--{option[5:]}" for option in known if option.startswith("--no-")}
    sentences = [(place, text) for place, text in texts if " " in text]
    unknown = {(place, option) for place, text in sentences for option in OPTION.findall(text) if option not in known}
    assert not unknown
    named = {(place, name) for place, text in sentences for name in COMMAND.findall(text)}
    verbs = {"is", "has", "adds", "can", "does", "needs", "wrote", "reads", "writes", "itself", "keyframes", "again"}
    assert not {(place, name) for place, name in named if name not in commands and name not in verbs}


def test_settings_that_messages_name_exist(texts):
    operators = open_host([]).operators
    for place, text in texts:
        for whole, short in SETTING.findall(text):
            idname, _, name = (whole or short).rpartition(".")
            assert idname in operators, (place, text)
            assert name in {p.name for p in operators[idname].properties}, (place, text)


URDF = """<robot name="two">
  <link name="base"><visual><geometry><box size="0.1 0.1 0.1"/></geometry></visual>
    <inertial><mass value="2"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="arm">INERTIAL
    <visual><origin xyz="0.2 0 0"/><geometry><box size="0.4 0.02 0.02"/></geometry></visual></link>
  <joint name="lift" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 0 1"/>
    <limit lower="-2" upper="2" effort="200" velocity="50"/></joint>
</robot>"""
INERTIAL = """<inertial><origin xyz="0.2 0 0"/><mass value="0.2"/>
    <inertia ixx="0.0001" iyy="0.002" izz="0.002" ixy="0" ixz="0" iyz="0"/></inertial>"""
ROWS = np.arange(31)
SWING = 0.5 * np.sin(ROWS / 5)


def table(head, times, values=SWING):
    rows = [f"{a:.20g},{b:.9f}" for a, b in zip(times, values, strict=True)]
    return "\n".join(["when,lift" if head is None else head, *rows]) + "\n"


def fitted(told):
    """The settings as told, with the names of the columns where they have placeholders."""
    return [part for text in SETTINGS.findall(told) for part in text.rstrip(",.;)").split(" ", 1)]


TABLES = {
    "degrees": (table("time_s,lift", ROWS / 30, 2.0 * np.degrees(SWING)), "degrees taken for radians"),
    "milliseconds": (table("time_s,lift", 1000.0 * ROWS / 30), "milliseconds taken for seconds"),
    "nanoseconds": (table("time_s,lift", 1e9 * ROWS / 30), "too long"),
    "microseconds": (table("time_s,lift", 1e6 * ROWS / 30), "too long"),
    "no times": (table(None, ROWS / 30), "no times"),
    "no names": ("\n".join(f"{v:.6f}" for v in SWING) + "\n", "no names of joints"),
}


@pytest.mark.parametrize("name", TABLES)
def test_settings_read_the_tables_for_which_they_are_told(calmotion, tmp_path, name):
    content, problem = TABLES[name]
    (tmp_path / "two.urdf").write_text(URDF.replace("INERTIAL", INERTIAL))
    (tmp_path / "take.csv").write_text(content)
    words = ("import", tmp_path / "two.urdf", "--motion", tmp_path / "take.csv", "-o", tmp_path / "shot.usda")
    first = calmotion(*words)
    said = " ".join((first.stdout + first.stderr).split())
    assert problem in said and "--set" in said
    told = said.replace("NAME,-,...", "-,lift" if name == "no times" else "lift").replace("60Hz", "30Hz")
    again = calmotion(*words, *fitted(told))
    assert again.returncode == 0 and problem not in again.stdout + again.stderr
    assert "31 frames" in again.stdout


SHOT, LAYER = "shot.usda", "calm.usda"
OPTIMIZE = ("optimize", SHOT, "-o", LAYER, "--quiet")
SIMULATE = ("simulate", SHOT, "--quiet")
EXPORT = ("export", SHOT, "--to", "csv", "-o", "commands.csv")
# A command, options that are refused, a part of the remedy, and the options as it says; $1 is what its group holds.
REFUSED = {
    "a scheme of no search": (OPTIMIZE, ("--integrator", "rk4"), "Remove the option", ()),
    "too much time": (
        OPTIMIZE, ("--set", "accuracy.analyse.max_hours=1e-7"), r"--set (accuracy\S+=\d+)", ("--set", "$1"),
    ),
    "a setting of no operator": (
        OPTIMIZE, ("--set", "element_size=5mm"), r"--set (fe\.mesh\.element_size=5mm)", ("--set", "$1"),
    ),
    "no setting": (OPTIMIZE, ("--set", "fe"), r"--set (\S+=5mm)", ("--set", "$1")),
    "a setting out of range": (
        OPTIMIZE, ("--retime", "slowest=0.5"), r"nearest allowed one is (\d)", ("--retime", "slowest=$1"),
    ),
    "a goal of a robust search": (OPTIMIZE, ("--goal", "1mm", "--robust"), "Remove --goal", ("--goal", "1mm")),
    "pins without retiming": (OPTIMIZE, ("--pin", "beats.csv"), "Add (--retime)", ("--retime", "--pin", "beats.csv")),
    "a length without a unit": (OPTIMIZE, ("--tolerance", "1"), "write 1m or (1mm)", ("--tolerance", "$1")),
    "a page of another name": (OPTIMIZE, ("--html", "page.txt"), r"Name a (\.html) file", ("--html", "page$1")),
    "a video of another kind": (
        OPTIMIZE, ("--video", "a.gif", "--set", "video.write.width=320", "--set", "video.write.rate=5"),
        r"Name a (\.webp)", ("--video", "a$1", "--set", "video.write.width=320", "--set", "video.write.rate=5"),
    ),
    "one output twice": (OPTIMIZE, ("--csv", LAYER), "Choose another", ("--csv", "errors.csv")),
    "a result over the shot": (OPTIMIZE, ("--csv", SHOT), "Choose another", ("--csv", "errors.csv")),
    "an option misspelled": (OPTIMIZE, ("--strickt",), "Did you mean (--strict)", ("$1",)),
    "a motion of no kind": (OPTIMIZE, ("--motion", "take.txt"), r"Name a (\.csv)", ("--motion", "take$1")),
    "a layer of another name": (
        ("optimize", SHOT, "--quiet"), ("-o", "calm.txt"), r"extension (\.usda)", ("-o", "calm$1"),
    ),
    "a shaper that is not there": (SIMULATE, ("--shaper", "xyz"), "Remove the option", ()),
    "a format that is not there": (EXPORT, ("--to", "nothing"), "Use one of .*(ros2)", ("--to", "$1")),
    "a controller of other robots": (EXPORT, ("--to", "ur"), "Use ros2 or (csv)", ("--to", "$1")),
    "a material that is not there": (("materials",), ("wood",), "Use ([a-z]+),", ("$1",)),
    "a motor that is not there": (("motors",), ("wood",), "`calmotion (motors)` lists", ()),
    "a farm that is not there": (("batch", SHOT, "-o", "out"), ("--on", "moon"), "Use (local)", ("--on", "$1")),
}  # fmt: skip


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_refused_runs_as_its_remedy_says(calmotion, tmp_path, monkeypatch, name):
    command, refused, remedy, instead = REFUSED[name]
    monkeypatch.chdir(tmp_path)
    (tmp_path / SHOT).write_text(ONE_HINGE)
    (tmp_path / "beats.csv").write_text("0\n5\n")
    (tmp_path / "take.csv").write_text("time_s,Hinge\n0,0\n0.5,0.1\n")
    first = calmotion(*command, *refused)
    said = " ".join((first.stdout + first.stderr).split())
    named = re.search(remedy, said)
    assert first.returncode in (1, 2) and named, said
    again = calmotion(*command, *(word.replace("$1", named[1]) if "$1" in word else word for word in instead))
    assert again.returncode == 0, again.stdout + again.stderr
