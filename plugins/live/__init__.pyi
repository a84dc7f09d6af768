"""Public names of `calmotion_plugins.live`: each is imported when it is first used."""

from collections.abc import Callable

from calmotion.host import Host

from .gains import Gains as Gains
from .gains import Weighting as Weighting
from .gains import gains_at as gains_at
from .lookahead import Worth as Worth
from .lookahead import worth_of_lookahead as worth_of_lookahead
from .opening import live as live
from .session import Live as Live
from .settings import LiveSettings as LiveSettings
from .stream import Stream as Stream
from .trial import Trial as Trial

register: Callable[[Host], None]
unregister: Callable[[Host], None]
