"""The command line, and what commands of plugins use of it. Each name is imported when it is first used.

A command is a module with `add_arguments(parser)` and `run(arguments, output) -> int`, which returns the exit status;
its `EXAMPLES`, pairs of a command line and what it is for, stand below its help.
"""

from calmotion.public_names import public_names

__getattr__, __dir__ = public_names(__name__)
