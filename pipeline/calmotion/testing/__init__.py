"""For authors of plugins: a host with only their plugin, a check of the rules, and characters to try it on.

The small arm of two beams suits most tests; beams with given meshes, chains and trees of them are the same on every
machine. Two other programs, MuJoCo and Exudyn, simulate robots to compare with. Each name is imported when it is first
used.
"""

from calmotion.public_names import public_names

__getattr__, __dir__ = public_names(__name__)
