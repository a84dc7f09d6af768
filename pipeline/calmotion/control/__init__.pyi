"""Public names of `calmotion.control`: each is imported when it is first used."""

from calmotion.control.commands import BEZIER as BEZIER
from calmotion.control.commands import CUBIC as CUBIC
from calmotion.control.commands import FOLLOW as FOLLOW
from calmotion.control.commands import HOLD as HOLD
from calmotion.control.commands import LINEAR as LINEAR
from calmotion.control.commands import QUINTIC as QUINTIC
from calmotion.control.commands import Commands as Commands
from calmotion.control.commands import Follower as Follower
from calmotion.control.commands import MotorCurves as MotorCurves
from calmotion.control.commands import instants as instants
from calmotion.control.sampling import bezier_commands as bezier_commands
from calmotion.control.sampling import followed_commands as followed_commands
from calmotion.control.sampling import held_commands as held_commands
from calmotion.control.sampling import smooth_commands as smooth_commands
