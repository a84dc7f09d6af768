"""Public names of `calmotion_plugins.live`: each is imported when it is first used."""

from collections.abc import Callable

from calmotion.host import Host

from .lookahead import Worth as Worth
from .lookahead import worth_of_lookahead as worth_of_lookahead
from .opening import live as live
from .regulation.gains import Gains as Gains
from .regulation.gains import Weighting as Weighting
from .regulation.gains import gains_at as gains_at
from .session import Live as Live
from .settings import LiveSettings as LiveSettings
from .stream import Stream as Stream
from .trial import Trial as Trial

register: Callable[[Host], None]
unregister: Callable[[Host], None]
