"""A plugin for tests of batches, whose operator kills its process, or waits until it may go on."""

TRAP = """
import os, signal, time
from dataclasses import dataclass
from pathlib import Path

from calmotion.host import Operator, registration
from calmotion.model import Character


@dataclass(frozen=True)
class Trap:
    pass


class Spring(Operator):
    idname = "trap.spring"
    label = "Spring the trap"
    requires = (Character,)
    provides = (Trap,)

    def execute(self, context):
        folder = Path(os.environ["TRAP_FOLDER"])
        kind, name = os.environ["TRAP_KIND"], f"{os.getpid()}.begun"
        first = not list(folder.glob("*.begun"))
        (folder / name).write_text("")
        if kind == "always" or (kind == "once" and first):
            os.kill(os.getpid(), signal.SIGKILL)
        while kind == "wait" and not (folder / "go").exists():
            time.sleep(0.02)
        return [Trap()]


register, unregister = registration(Spring)
"""
SPRUNG = ("--run=trap.spring", "--step=0.01s")
