"""Public names of `calmotion_plugins.shows`: each is imported when it is first used."""

from collections.abc import Callable

from calmotion.host import Host

from .batch.report import BatchResult as BatchResult
from .batch.report import JobResult as JobResult
from .batch.run import batch as batch
from .sequence.run import Repertoire as Repertoire
from .sequence.run import sequence as sequence

register: Callable[[Host], None]
unregister: Callable[[Host], None]
