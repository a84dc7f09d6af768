"""A survey that processes run, and that crashes on one link: they import it by its name."""

import os
import signal

from calmotion_plugins.benchmarks.links.survey import survey_link


def odd_survey(link, *rest):
    """The survey of a link, in which that with the name `fore` ends the process."""
    if link.name == "fore":
        os.kill(os.getpid(), signal.SIGSEGV)
    return survey_link(link, *rest)
