"""Small shots of servos, from the text of their robots."""

from pxr import Usd

HEAD = """#usda 1.0
(
    defaultPrim = "Robot"
    metersPerUnit = 1
    kilogramsPerUnit = 1
    upAxis = "Z"
    timeCodesPerSecond = 24
    startTimeCode = 0
    endTimeCode = 24
)
"""


def written(folder, robot):
    """A shot of a second of `/Robot`."""
    (folder / "shot.usda").write_text(HEAD + robot)
    return folder / "shot.usda"


def edited(shot, prim, edit):
    """The shot after an edit of a prim."""
    stage = Usd.Stage.Open(str(shot))
    edit(stage.GetPrimAtPath(prim))
    stage.Save()
    return shot
