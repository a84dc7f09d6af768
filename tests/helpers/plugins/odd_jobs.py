"""A function that processes run, and that raises, crashes or hangs: they import it by its name."""

from __future__ import annotations

import os
import signal
import time


def odd_job(kind, value):
    if kind == "raise":
        raise ValueError(f"no {value}")
    if kind == "crash":
        os.kill(os.getpid(), signal.SIGSEGV)
    if kind == "exit":
        os._exit(3)
    if kind == "hang":
        time.sleep(1e3)
    return value, os.getpid()


def odd_survey(link, *rest):
    """The survey of a link, in which that with the name `fore` ends the process."""
    from calmotion.benchmarks.links.survey import survey_link

    if link.name == "fore":
        os.kill(os.getpid(), signal.SIGSEGV)
    return survey_link(link, *rest)
