"""Python finds this first where its folder is on PYTHONPATH: an interpreter in which Calmotion meets no POSIX.

For Calmotion's modules, POSIX's modules, functions, flags and signals are not there. For the dependencies they are,
which choose by `sys.platform` and are tested on Windows by others. Nobody can make links, and processes are spawned.
Capitals in names of files make no difference to Python's functions, files that Calmotion opens without an encoding have
that of western Windows, and there is no folder of open files.
"""

import builtins
import errno
import functools
import importlib
import io
import multiprocessing
import os
import signal
import sys

MODULES = {"fcntl", "grp", "pty", "pwd", "resource", "syslog", "termios", "tty"}
FUNCTIONS = (
    "chown", "fchmod", "fork", "forkpty", "getegid", "geteuid", "getgid", "getuid", "killpg", "mkfifo", "nice",
    "pread", "pwrite", "sched_getaffinity", "sched_setaffinity", "setsid", "statvfs", "sysconf", "uname",
    "wait3", "wait4", "waitid",
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


def as_on_disk(path):
    """A path, its parts spelled as those that are there."""
    if not isinstance(path, (str, bytes, os.PathLike)):
        return path
    text = os.fspath(path)
    head, name = os.path.split(text)
    if not name or head == text:
        return path
    folder = as_on_disk(head)
    try:
        there = real_listdir(folder or (b"." if isinstance(text, bytes) else "."))
    except OSError:
        return os.path.join(folder, name)
    like = [other for other in there if len(other) == len(name) and other.lower() == name.lower()]
    return os.path.join(folder, name if name in like or not like else like[0])


def caseless(function, names=1):
    """A function of files to which capitals make no difference in the first of its arguments, which are paths."""

    @functools.wraps(function)
    def call(*arguments, **options):
        if str(arguments[:1]).startswith("('/dev/fd"):
            raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), *arguments[:1])
        if not {"dir_fd", "src_dir_fd", "dst_dir_fd"} & set(options):
            arguments = (*map(as_on_disk, arguments[:names]), *arguments[names:])
        return function(*arguments, **options)

    return call


def opened_as_on_windows(function):
    """`open`, for Calmotion in the encoding of western Windows where none is named."""

    def call(file, mode="r", buffering=-1, encoding=None, *arguments, **options):
        depth = 2 if sys._getframe(1).f_globals.get("__name__") != "pathlib" else 3
        if encoding in (None, "locale") and "b" not in mode and (by_calmotion(depth) or by_calmotion(depth + 1)):
            encoding = "cp1252"
        return function(file, mode, buffering, encoding, *arguments, **options)

    return call


real_listdir = os.listdir
for name in ("access", "listdir", "lstat", "mkdir", "open", "remove", "rmdir", "scandir", "stat", "unlink", "utime"):
    setattr(os, name, caseless(getattr(os, name)))
for name in ("rename", "replace"):
    setattr(os, name, caseless(getattr(os, name), 2))
builtins.open = io.open = opened_as_on_windows(caseless(io.open))
multiprocessing.set_start_method("spawn", force=True)
builtins.__import__ = without(builtins.__import__)
importlib.import_module = without(importlib.import_module)
hide(os, (*FUNCTIONS, *FLAGS))
hide(signal, SIGNALS)
for name in ("link", "symlink"):
    delattr(os, name)
