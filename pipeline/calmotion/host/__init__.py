"""The host of plugins: it finds and registers them, orders their operators by data, and runs those that are needed."""

from calmotion.host.errors import HostError, PlanError, PluginError, SettingError
from calmotion.host.manifest import Manifest, read_manifest
from calmotion.host.operators import NotAsked, Operator, Record, RunContext, registration
from calmotion.host.plan import Plan
from calmotion.host.properties import Property, PropertyValues
from calmotion.host.registry import Host, Plugin, PluginState, open_host
from calmotion.host.run import OperatorResult, Outcome, Reuse, Run
from calmotion.host.settings import Settings, merge, read_assignment, read_settings_file
from calmotion.host.units import has_no_unit, parse_quantity, quantity_of
from calmotion.support.naming import nearest

__all__ = [
    "Host",
    "HostError",
    "Manifest",
    "NotAsked",
    "Operator",
    "OperatorResult",
    "Outcome",
    "Plan",
    "PlanError",
    "Plugin",
    "PluginError",
    "PluginState",
    "Property",
    "PropertyValues",
    "Record",
    "Reuse",
    "Run",
    "RunContext",
    "SettingError",
    "Settings",
    "has_no_unit",
    "merge",
    "nearest",
    "open_host",
    "parse_quantity",
    "quantity_of",
    "read_assignment",
    "read_manifest",
    "read_settings_file",
    "registration",
]
