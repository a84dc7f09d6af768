"""What scripts and the command line call: a shot is opened, simulated, optimised, verified or rigged.

Nothing here prints or reads arguments of a command line. `import calmotion` offers the names that users need.
"""

from calmotion.public_names import public_names

__getattr__, __dir__ = public_names(__name__)
