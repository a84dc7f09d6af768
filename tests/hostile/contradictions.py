"""Hostile combinations: outputs of `watch`, logs and folders in odd places, tables of motions, URDF robots."""

from commands import FAIL, ROBOT, SOFT, beside, imported, words
from hostile import DONE, REFUSED, USAGE, Case

TABLE = "time_s,shoulder\n0,0\n0.5,0.2\n1,0\n"


def table(text: str, *told: str, statuses: tuple[int, ...] = REFUSED, judge=None, coding: str = "utf-8") -> Case:
    """`calmotion simulate` with a table as its motion."""

    def make(folder):
        beside()(folder)
        (folder / "a.csv").write_bytes(text.encode(coding))

    line = ("simulate", "shot.usda", "--motion", "a.csv", "--step", "10ms", "--json")
    return Case(make, line, statuses, told, judge=judge)


def robot(change, *told: str) -> Case:
    """`calmotion import` of a robot that is refused before it is converted."""
    return words("import robot.urdf -o x.usda --json", *told, make=imported(change(ROBOT)), statuses=REFUSED)


def beyond_limits(report: dict) -> str:
    """A fault where a motion of 0.2 rad or 20 degrees is beyond the limits of the arm."""
    return "radians are taken for degrees" if any(use["exceeded"] for use in report["limits"]) else ""


CASES: dict[str, Case] = {
    # outputs
    "a watch whose manifest is the shot": words(
        "watch shot.usda --runs 1 --manifest shot.usda --json", "--manifest", statuses=USAGE
    ),
    "a watch of splines without a layer": words(
        "watch shot.usda --runs 1 --splines --json", "--splines", statuses=USAGE
    ),
    "a strict watch that misses its tolerance": words(
        "watch shot.usda --runs 1 --strict --step 40ms --tolerance 0.001mm --json", make=SOFT, statuses=(1,)
    ),
    "a home folder that no shell has replaced": words(
        "simulate shot.usda --csv ~/out.csv --json", "home folder", statuses=USAGE
    ),
    "a file that ends in a slash": words("simulate shot.usda --csv out/ --json", "Is a directory", statuses=USAGE),
    "a test motion of no tries": words("excite shot.usda -o out.usda --tries 0 --json", "--tries", statuses=USAGE),
    "a verification where the tolerance leaves no mode": words(
        "simulate shot.usda --verify --step 10ms --json", "verified_error_m", make=SOFT, statuses=DONE
    ),
    # tables
    "a table in milliseconds": table(
        TABLE.replace("1,0", "1000,0").replace("0.5", "500"), "comes later is not played", statuses=DONE
    ),
    "a table that ends before the shot": table("time_s,shoulder\n0,0\n0.5,0.2\n", "last pose is held", statuses=DONE),
    "a table in degrees by its comment": table(
        "# Units: angle Deg\n" + TABLE.replace("0.2", "20"), statuses=DONE, judge=beyond_limits
    ),
    "a table with decimal commas": table('time_s,shoulder\n0,"0"\n"0,5","0,2"\n', statuses=DONE),
    "a table of another coding": table(TABLE, "UTF-8", coding="utf-16"),
    "a table with its head twice": table(TABLE + TABLE, "line 5"),
    # robots
    "a robot of two roots": robot(lambda text: text.replace("</robot>", '<link name="c"/></robot>'), "several roots"),
    "a joint that mimics itself": robot(lambda text: text.replace("<limit", '<mimic joint="j"/><limit'), "j -> j"),
    "a robot with an argument of xacro": robot(
        lambda text: text.replace("<axis", '<origin xyz="$(arg x) 0 0"/><axis'), "Run `xacro"
    ),
    "a package without a folder": words(
        "import robot.urdf -o x.usda --package r --json", "--package", make=imported(ROBOT), statuses=FAIL
    ),
}
