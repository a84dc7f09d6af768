"""Hostile command lines: options that contradict each other, values that are none, inputs of the wrong kind."""

from functools import partial
from pathlib import Path

from hostile import DONE, EITHER, USAGE, Case, arm
from shot_edits import flexible

SHOT = arm()
SOFT = arm(flexible(lambda stage: None))
FAIL = (1, 2)
ROBOT = """<?xml version="1.0"?><robot name="r"><link name="a"/><link name="b"><inertial><mass value="1"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link><joint name="j" type="revolute">
<parent link="a"/><child link="b"/><axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="5" velocity="5"/></joint>
</robot>
"""


def words(
    line: str, *told: str, make=SHOT, statuses: tuple[int, ...] = FAIL, seconds: float = 60.0,
    outputs: tuple[str, ...] = ("out.usda", "out_root.usda"), kept: bool = False,
) -> Case:  # fmt: skip
    """A whole command line."""
    return Case(make, tuple(line.split()), statuses, told, outputs, seconds, kept=kept)


def on_shot(
    command: str, options: str, *told: str, statuses: tuple[int, ...] = FAIL, make=SHOT, outputs: tuple[str, ...] = ()
) -> Case:
    return words(
        f"{command} shot.usda --json {options}",
        *told,
        statuses=statuses,
        make=make,
        outputs=("out.usda", "out_root.usda", *outputs),
    )


simulated, optimized = partial(on_shot, "simulate"), partial(on_shot, "optimize")


def beside(**files: str):
    """The arm and further text files; `_` in a name stands for a dot."""

    def make(folder: Path) -> None:
        SHOT(folder)
        for name, text in files.items():
            (folder / name.replace("_", ".")).write_text(text)

    return make


def layered(folder: Path) -> None:
    """The arm as a sublayer of the shot."""
    arm(name="part.usda")(folder)
    text = (folder / "part.usda").read_text()
    head = text[: text.index(")\n") + 2].replace("(\n", "(\n    subLayers = [@./part.usda@]\n", 1)
    (folder / "shot.usda").write_text(head)


def imported(text: str, name: str = "robot.urdf"):
    return lambda folder: (folder / name).write_text(text) and None


CASES: dict[str, Case] = {
    # the program
    "no command": words("", "usage"),
    "a command that is none": words("simulat shot.usda", "simulate", statuses=USAGE),
    "an option that is none": words("simulate shot.usda --fast", "--fast", statuses=USAGE),
    "an option of another command": words("simulate shot.usda --robust", "--robust", statuses=USAGE),
    "a shortened option": words("simulate shot.usda --tol 1mm --json", statuses=(0, 2)),
    "no shot": words("simulate", "SHOT", statuses=USAGE),
    "two shots": words("simulate shot.usda shot.usda", "shot.usda", statuses=USAGE),
    "an output without a name": words("simulate shot.usda -o", "-o", statuses=USAGE),
    "optimize without an output": words("optimize shot.usda", statuses=(0, 2)),
    "a shot that is not there": words("simulate gone.usda --json", "gone.usda"),
    "a shot that is a folder": words("simulate . --json"),
    "a shot with an empty name": Case(SHOT, ("simulate", "", "--json"), FAIL),
    "a shot that is a device": words("simulate /dev/null --json", "/dev/null"),
    "a shot that never ends": words("simulate /dev/zero --json", "/dev/zero"),
    "a shot of the network": words("simulate https://example.com/shot.usda --json", "https"),
    "a shot with a NUL in its name": Case(SHOT, ("simulate", "shot\0.usda", "--json"), FAIL),
    "an option that is an empty word": Case(
        SHOT, ("simulate", "shot.usda", "--json", "--tolerance", ""), FAIL, ("--tolerance",)
    ),
    # tolerances and steps
    "a tolerance without a unit": simulated("--tolerance 1", "--tolerance", statuses=(0, 1, 2)),
    "a tolerance in hertz": simulated("--tolerance 1Hz", "--tolerance", statuses=USAGE),
    "a negative tolerance, as an option": simulated("--tolerance=-1mm", "--tolerance"),
    "a tolerance of 1e-300": simulated("--tolerance 1e-300mm", "tolerance", make=SOFT, statuses=(0, 1, 2)),
    "a tolerance of 1e300": simulated("--tolerance 1e300mm", make=SOFT, statuses=(0, 1, 2)),
    "an infinite tolerance, as an option": simulated("--tolerance inf", "--tolerance"),
    "a tolerance in words": simulated("--tolerance fine", "--tolerance", statuses=USAGE),
    "two tolerances": simulated("--tolerance 1mm --tolerance 2mm", statuses=DONE),
    "a step of a picosecond": simulated("--step 1ps", "--step", statuses=FAIL),
    "a step of an hour": simulated("--step 1h", statuses=(0, 1, 2)),
    "a step in millimetres": simulated("--step 1mm", "--step", statuses=USAGE),
    "a tolerance and a step that contradict": simulated("--tolerance 0.001mm --step 40ms", make=SOFT, statuses=DONE),
    "the same, strictly": simulated("--tolerance 0.001mm --step 40ms --strict", make=SOFT, statuses=(0, 1)),
    # integrators and models
    "an integrator that is none": simulated("--integrator euler", "bdf2", statuses=USAGE),
    "rk4 with a long step on stiff links": simulated("--integrator rk4 --step 40ms", make=SOFT, statuses=(0, 1)),
    "rk4 with a short step": simulated("--integrator rk4 --step 1ms", make=SOFT, statuses=(0, 1)),
    "keep and leave out the same": simulated("--keep modes --leave-out modes", "modes"),
    "keep all and leave out all": simulated("--keep all --leave-out all", "all"),
    "keep the modes and leave out all else": simulated("--keep modes --leave-out all", statuses=DONE),
    "keep something that is none": simulated("--keep colours", "--keep|colours", statuses=USAGE),
    "leave out everything": simulated("--leave-out all", make=SOFT, statuses=(0, 1)),
    "leave out all motors": optimized("-o out.usda --leave-out motors", statuses=EITHER),
    "ideal motors of ideal motors": simulated("--motors ideal", statuses=DONE),
    "motors of a kind that is none": simulated("--motors magic", "--motors", statuses=USAGE),
    "a shaper of a rigid robot": simulated("--shaper zvd", statuses=EITHER),
    "a shaper of two modes where there is one": simulated("--shaper zvd2", make=SOFT, statuses=EITHER),
    "a robust search without anything flexible": optimized("-o out.usda --robust", statuses=EITHER),
    "a set of robots that is no set": optimized("-o out.usda --robust best", "--robust", statuses=USAGE),
    "robots without a robust search": optimized("-o out.usda --scenarios 3", "--robust", statuses=FAIL),
    # outputs that contradict
    "the shot as its own output": simulated("-o shot.usda", "shot.usda"),
    "the shot as its own manifest": simulated("--manifest shot.usda", "shot.usda"),
    "a layer of the shot as a manifest": simulated("--manifest part.usda", "part.usda", make=layered),
    "splines without a layer": simulated("--splines", "-o", statuses=USAGE),
    "the shot as its own table": simulated("--csv shot.usda", "shot.usda"),
    "one file for two outputs": simulated("-o out.usda --csv out.usda", "out.usda"),
    "one file for three outputs": simulated("--csv x.rrd --rrd x.rrd --manifest x.rrd", "x.rrd"),
    "the same file by another path": simulated("--csv x.txt --manifest ./x.txt", "x.txt"),
    "a layer with another suffix": simulated("-o out.txt", "out.txt"),
    "a layer without a suffix": simulated("-o out", "out", statuses=FAIL),
    "a layer that is a package": simulated("-o out.usdz", "usdz", statuses=FAIL),
    "a layer in binary": simulated(
        "-o out.usdc", statuses=DONE, outputs=("out.usdc", "out_root.usdc", "out_root.usda")
    ),
    "a video of a kind that is none": simulated("--video out.gif", "gif|webp"),
    "a recording of a kind that is none": simulated("--rrd out.mp4", statuses=EITHER, outputs=("out.mp4",)),
    "an output in a folder that is not there": simulated(
        "-o deep/down/out.usda", statuses=(0, 1, 2), outputs=("deep",)
    ),
    "an output that is a folder": simulated("-o .", statuses=FAIL),
    "an output on a device": simulated("--csv /dev/full", "/dev/full", statuses=FAIL),
    "figures in a file": simulated("--figures shot.usda", "shot.usda"),
    "baked without a layer": simulated("--bake", "-o", statuses=USAGE),
    "splines and samples": simulated("-o out.usda --splines --samples-per-second 100Hz", statuses=(0, 1, 2)),
    "samples of zero hertz": simulated("-o out.usda --samples-per-second 0", "samples-per-second", statuses=USAGE),
    "a billion samples a second": optimized(
        "-o out.usda --samples-per-second 1e9", "samples-per-second", statuses=(0, 1, 2)
    ),
    "strict without anything to keep": simulated("--strict", statuses=DONE),
    # settings
    "a setting without a value": simulated("--set fe.mesh.element_size", "fe.mesh.element_size|--set", statuses=USAGE),
    "a setting that is none": simulated("--set fe.mesh.colour=3", "colour", statuses=USAGE),
    "a setting of an operator that is none": simulated("--set foo.bar=3", "foo", statuses=USAGE),
    "a setting of a wrong unit": simulated("--set fe.mesh.element_size=5Hz", "element_size", statuses=USAGE),
    "a setting that is no number": simulated("--set fe.mesh.element_size=nan", "element_size", statuses=USAGE),
    "a setting of 1e-30 m": simulated("--set fe.mesh.element_size=1e-30m", "element_size", make=SOFT),
    "a setting of 1e30 m": simulated("--set fe.mesh.element_size=1e30m", make=SOFT, statuses=(0, 1, 2)),
    "settings that are not there": simulated("--settings gone.toml", "gone.toml"),
    "settings that are no TOML": simulated("--settings a.toml", "a.toml", make=beside(a_toml="= = =")),
    "settings of a wrong type": simulated(
        "--settings a.toml", "element_size", make=beside(a_toml='[fe.mesh]\nelement_size = [1, "x"]\n')
    ),
    "settings that are binary": simulated("--settings a.toml", "a.toml", make=beside(a_toml="\0\0\0")),
    "an operator that is none": simulated("--run no.such", "no.such", statuses=USAGE),
    "plugins in a folder that is not there": simulated("--plugins gone", "gone"),
    "plugins in a file": simulated("--plugins shot.usda", "shot.usda"),
    "a plugin without a module": simulated(
        "--plugins .",
        "plugin.toml|mine",
        statuses=(0, 1, 2),
        make=lambda folder: (
            SHOT(folder),
            (folder / "mine").mkdir(),
            (folder / "mine" / "plugin.toml").write_text("id = 3"),
            None,
        )[-1],
    ),
    # motions
    "a motion that is the shot": simulated("--motion shot.usda", "shot.usda"),
    "a motion of a kind that is none": simulated("--motion a.xyz", "a.xyz", make=beside(a_xyz="1 2 3")),
    "an empty table": simulated("--motion a.csv", "a.csv", make=beside(a_csv="")),
    "a table of words": simulated("--motion a.csv", "a.csv", make=beside(a_csv="time_s,shoulder\n0,up\n1,down\n")),
    "a table whose times go back": simulated(
        "--motion a.csv", "a.csv", make=beside(a_csv="time_s,shoulder\n0,0\n1,0.1\n0.5,0.2\n")
    ),
    "a table of numbers that are none": simulated(
        "--motion a.csv", "a.csv", make=beside(a_csv="time_s,shoulder\n0,nan\n1,0.1\n")
    ),
    "a table of other joints": simulated(
        "--motion a.csv", "a.csv|nose", make=beside(a_csv="time_s,nose\n0,0\n1,0.1\n")
    ),
    "a table of one row": simulated("--motion a.csv", make=beside(a_csv="time_s,shoulder\n0,0\n"), statuses=(0, 1, 2)),
    "a table in degrees by mistake": simulated(
        "--motion a.csv", make=beside(a_csv="time_s,shoulder\n0,0\n1,90\n"), statuses=EITHER
    ),
    "a table with two columns of a joint": simulated(
        "--motion a.csv", "a.csv|shoulder", make=beside(a_csv="time_s,shoulder,shoulder\n0,0,1\n1,0.1,1\n")
    ),
    "a BVH of nothing": simulated("--motion a.bvh", "a.bvh", make=beside(a_bvh="HIERARCHY\n")),
    # other commands
    "a template over the shot": words("submit shot.usda --openjd shot.usda -o out --json", "--openjd", statuses=USAGE),
    "a template in the place of the results": words("submit shot.usda --openjd out -o out --json", statuses=USAGE),
    "a batch at a place that is none": words("batch shot.usda -o out --on cloud --json", "--on", statuses=USAGE),
    "an output named by a dash": simulated("--csv -", "standard output", statuses=USAGE),
    "an output on the standard output": simulated("--csv /dev/stdout", "/dev/stdout", statuses=USAGE),
    "an option before the command": words("--quiet simulate shot.usda", "behind the command", statuses=USAGE),
    "a negative value behind a blank": words(
        "export shot.usda --to csv --start-delay -5ms", "--start-delay", statuses=USAGE
    ),
    "an export to nothing": words("export shot.usda --json", "--to", statuses=USAGE),
    "an export to a format that is none": words("export shot.usda --to dance --json", "dance", statuses=USAGE),
    "an export at zero hertz": words("export shot.usda --to csv --rate 0 --json", "--rate"),
    "an export at a terahertz": words(
        "export shot.usda --to csv --rate 1e12 --json -o x.csv", "--rate|memory", statuses=FAIL
    ),
    "an export that starts an hour late": words(
        "export shot.usda --to csv --start-delay 3600s --json -o x.csv", statuses=(0, 1, 2), outputs=("x.csv",)
    ),
    "an export over the shot": words("export shot.usda --to csv -o shot.usda --json", "shot.usda"),
    "servo ticks without a table": words("export shot.usda --to ticks --json -o x.csv", "motors", statuses=FAIL),
    "an import of a shot": words("import shot.usda -o x.usda --json", statuses=DONE, outputs=("x.usda",)),
    "an import of nothing": words("import a.urdf -o x.usda --json", "a.urdf", make=beside(a_urdf="")),
    "an import of no robot": words("import a.urdf -o x.usda --json", "a.urdf", make=beside(a_urdf="<html/>")),
    "an import that reads entities": words(
        "import a.urdf -o x.usda --json",
        "a.urdf",
        make=beside(a_urdf='<!DOCTYPE a [<!ENTITY b SYSTEM "file:///etc/passwd">]><robot name="&b;"/>'),
    ),
    "an import of a bomb of entities": words(
        "import a.urdf -o x.usda --json",
        "a.urdf",
        make=beside(
            a_urdf='<!DOCTYPE a [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;&a;">]><robot name="&b;"/>'
        ),
        statuses=(0, 1, 2),
    ),
    "an import over its robot": words("import robot.urdf -o robot.urdf --json", "robot.urdf", make=imported(ROBOT)),
    "an import with a material that is none": words(
        "import robot.urdf -o x.usda --flexible b=cheese --json", "cheese", make=imported(ROBOT)
    ),
    "a calibration without recordings": words("calibrate shot.usda -o x.usda --json", "--recording", statuses=USAGE),
    "a calibration by the shot": words("calibrate shot.usda --recording shot.usda -o x.usda --json", "shot.usda"),
    "a test motion of no length": words("excite shot.usda -o x.usda --duration 0s --json", "--duration", statuses=FAIL),
    "a rig of a robot": words("rig shot.usda -o x.usda --json", "shot.usda|skel|Skel"),
    "a batch of nothing": words("batch -o out", "SHOT", statuses=USAGE),
    "a batch of a shot that is not there": words(
        "batch gone.usda -o out --json", "gone.usda", outputs=("out",), kept=True
    ),
    "a sequence that is no TOML": words("sequence shot.usda -o out --json", "shot.usda", outputs=("out",)),
    "a motor that is none": words("motors XM9999 --json", "XM9999"),
    "a material that is none": words("materials cheese --json", "cheese"),
    "an inspection of modes into a file": words("inspect shot.usda --modes shot.usda --json", "shot.usda"),
}
