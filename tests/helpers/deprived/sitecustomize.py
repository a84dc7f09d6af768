"""Python finds this first where its folder is on PYTHONPATH: an interpreter in which Calmotion meets no POSIX.

For Calmotion's modules, POSIX's modules, functions, flags and signals are not there. For the dependencies they are,
which choose by `sys.platform` and are tested on Windows by others. Nobody can make links, and processes are spawned.
"""

import builtins
import importlib
import multiprocessing
import os
import signal
import sys

MODULES = {"fcntl", "grp", "pty", "pwd", "resource", "syslog", "termios", "tty"}
FUNCTIONS = (
    "chown", "fchmod", "fork", "forkpty", "getegid", "geteuid", "getgid", "getuid", "killpg", "mkfifo", "nice",
    "pread", "pwrite", "sched_getaffinity", "sched_setaffinity", "setsid", "statvfs", "sysconf", "uname",
)  # fmt: skip
FLAGS = ("O_CLOEXEC", "O_DIRECTORY", "O_NOFOLLOW", "O_NONBLOCK", "O_TMPFILE", "WNOHANG")
SIGNALS = ("SIGALRM", "SIGHUP", "SIGKILL", "SIGPIPE", "SIGQUIT", "SIGUSR1", "SIGXCPU", "alarm", "setitimer")
OURS = ("calmotion", "calmotion_plugins")


def by_calmotion(depth):
    """Whether the caller's caller is a module of Calmotion."""
    return str(sys._getframe(depth).f_globals.get("__name__")).partition(".")[0] in OURS


def hide(module, names):
    """Take names away from a module; it still gives them to others than Calmotion."""
    hidden = {name: vars(module).pop(name) for name in names if name in vars(module)}

    def found(name):
        if name not in hidden or by_calmotion(2):
            raise AttributeError(f"module {module.__name__!r} has no attribute {name!r}")
        return hidden[name]

    module.__getattr__ = found


def without(imported):
    """An import function that does not find modules of POSIX for Calmotion."""

    def load(name, *arguments, **options):
        if name in MODULES and by_calmotion(2):
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)
        return imported(name, *arguments, **options)

    return load


multiprocessing.set_start_method("spawn", force=True)
builtins.__import__ = without(builtins.__import__)
importlib.import_module = without(importlib.import_module)
hide(os, (*FUNCTIONS, *FLAGS))
hide(signal, SIGNALS)
for name in ("link", "symlink"):
    delattr(os, name)
