"""Errors of the host: the same fields as `ShotError`, so that one place prints both."""

from calmotion.errors import ShotError


class HostError(ShotError):
    """Something about plugins, settings or the order of operators is wrong; `path` names it."""


class PluginError(HostError):
    """A plugin, its manifest or one of its operators does not follow the rules."""


class SettingError(HostError):
    """A setting that the user gave does not exist or has a wrong value: wrong usage, exit status 2."""


class PlanError(HostError):
    """The available operators cannot make the wanted values."""
