"""Public names of `calmotion_plugins.diagnosis`: each is imported when it is first used."""

from collections.abc import Callable

from calmotion.host import Host

from .comparison import Cause as Cause
from .comparison import Diagnosis as Diagnosis
from .comparison import diagnosis_of as diagnosis_of
from .diagnosing import DiagnosedShot as DiagnosedShot
from .diagnosing import diagnose as diagnose
from .opening import situation_of as situation_of
from .situation import Situation as Situation

register: Callable[[Host], None]
unregister: Callable[[Host], None]
