"""A function that processes run, and that refuses, raises, crashes or hangs: they import it by its name."""

import os
import signal
import time

from calmotion.errors import ShotError


def odd_job(kind, value):
    if kind == "refuse":
        raise ShotError(f"there are no {value}", path="SHOTS")
    if kind == "raise":
        raise ValueError(f"no {value}")
    if kind == "crash":
        os.kill(os.getpid(), signal.SIGSEGV)
    if kind == "exit":
        os._exit(3)
    if kind == "hang":
        time.sleep(1e3)
    return value, os.getpid()
