"""The host: plugins with their states, and the operators that they registered. There are no globals."""

from __future__ import annotations

import traceback
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from types import ModuleType
from typing import Any

from calmotion.host.discovery import Location, discover, import_plugin
from calmotion.host.errors import PluginError, SettingError
from calmotion.host.manifest import Manifest, check_requirements, read_manifest
from calmotion.host.operators import Operator, check_operator
from calmotion.host.plan import Plan, make_plan
from calmotion.host.properties import PropertyValues, values_of
from calmotion.host.run import Reuse, Run
from calmotion.host.settings import Settings, disabled_plugins
from calmotion.support import interrupts
from calmotion.support.naming import nearest
from calmotion.version import __version__


class PluginState(StrEnum):
    """How far a plugin came."""

    FOUND = "found"
    REGISTERED = "registered"
    FAILED = "failed"
    DISABLED = "disabled"


REGISTERED = PluginState.REGISTERED


@dataclass
class Plugin:
    """A plugin and how far it came.

    Attributes:
        id: From its manifest, or the folder's name when the manifest cannot be read.
        location: Where it was found.
        manifest: None when it cannot be read.
        state: How far it came.
        error: Why it failed, or None.
        traceback: Where it failed, or empty.
        module: Its module once imported.
        operators: What it registered.
    """

    id: str
    location: Location
    manifest: Manifest | None = None
    state: PluginState = PluginState.FOUND
    error: BaseException | None = None
    traceback: str = ""
    module: ModuleType | None = None
    operators: list[type[Operator]] = field(default_factory=list)

    def fail(self, error: BaseException) -> None:
        """Remember why it failed, with the traceback."""
        self.state = PluginState.FAILED
        self.error = error
        self.traceback = "".join(traceback.format_exception(error))
        self.operators = []


class Host:
    """Holds plugins and operators, orders operators by their data, and runs them."""

    def __init__(self) -> None:
        self.plugins: list[Plugin] = []
        self._registering: Plugin | None = None

    def __reduce__(self) -> tuple[Any, ...]:
        """Modules of plugins stay in their process.

        Raises:
            TypeError: Always.
        """
        raise TypeError(
            "shots and results cannot be sent to another process, since they hold plugins: open the shot there, and "
            "send the report(), the motion or the columns() of the result"
        )

    @property
    def operators(self) -> dict[str, type[Operator]]:
        """Idname to operator, of the plugins that are registered, in the order of the plugins."""
        return {cls.idname: cls for plugin in self.plugins for cls in plugin.operators if plugin.state is REGISTERED}

    def plugin(self, plugin_id: str) -> Plugin:
        """The plugin of that id, a working one first.

        Raises:
            PluginError: When there is none.
        """
        matching = sorted((p for p in self.plugins if p.id == plugin_id), key=lambda p: p.state == PluginState.FAILED)
        if not matching:
            raise PluginError("there is no such plugin", path=plugin_id, remedy="See calmotion plugins list.")
        return matching[0]

    def plugin_of(self, idname: str) -> Plugin:
        """The plugin that registered an operator."""
        return next(plugin for plugin in self.plugins if any(cls.idname == idname for cls in plugin.operators))

    def add(self, location: Location) -> Plugin:
        """Read a plugin's manifest and remember the plugin; a problem becomes its state, not an exception."""
        plugin = Plugin(location.folder.name, location)
        try:
            plugin.manifest = read_manifest(location.folder)
            for other in self.plugins:
                if other.id == plugin.id and other.manifest is not None:
                    raise PluginError(
                        f"a plugin with the id {plugin.id} exists already",
                        path=str(location.folder),
                        found=other.location.folder,
                        remedy="Rename or disable one of the two.",
                    )
        except PluginError as error:
            plugin.fail(error)
            plugin.traceback = ""  # the error names the file and the field
        self.plugins.append(plugin)
        return plugin

    def load(self, plugin: Plugin) -> None:
        """Import a plugin and let it register: all of its operators, or none and a stored traceback."""
        if plugin.state != PluginState.FOUND or plugin.manifest is None:
            return
        try:
            check_requirements(plugin.manifest, __version__)
            plugin.module = import_plugin(plugin.id, plugin.location)
            self._call(plugin, plugin.module.register)
            plugin.state = REGISTERED
        except (Exception, SystemExit) as error:
            interrupts.check()  # an import may make another error of it
            plugin.fail(error)
        interrupts.check()

    def unload(self, plugin: Plugin) -> tuple[type[Operator], ...]:
        """Let a plugin unregister; one that raises is marked as failed.

        Returns:
            The operators that it forgot to take back; they are taken back here.
        """
        if plugin.state is not REGISTERED or plugin.module is None:
            return ()
        try:
            self._call(plugin, plugin.module.unregister)
        except (Exception, SystemExit) as error:
            plugin.fail(error)
            return ()
        forgotten = tuple(plugin.operators)
        plugin.operators = []
        plugin.state = PluginState.FOUND
        return forgotten

    def _call(self, plugin: Plugin, function: Callable[[Host], None]) -> None:
        self._registering = plugin
        try:
            function(self)
        finally:
            self._registering = None

    def register_operator(self, cls: type[Operator]) -> None:
        """Add an operator; called by a plugin's `register(host)`.

        Raises:
            PluginError: When the class is not well-formed, its idname is taken, or no plugin is registering.
        """
        plugin = self._asking("register_operator")
        check_operator(cls)
        for other in self.plugins:
            if any(known.idname == cls.idname for known in other.operators):
                raise PluginError(
                    f"the idname {cls.idname} is already taken by the plugin {other.id}",
                    path=plugin.id,
                    remedy="Give the operator another idname.",
                )
        plugin.operators.append(cls)

    def unregister_operator(self, cls: type[Operator]) -> None:
        """Take back an operator; called by a plugin's `unregister(host)`.

        Raises:
            PluginError: When that plugin did not register it.
        """
        plugin = self._asking("unregister_operator")
        if cls not in plugin.operators:
            raise PluginError(
                "the plugin unregisters an operator that it did not register", path=plugin.id, found=cls.__name__
            )
        plugin.operators.remove(cls)

    def _asking(self, method: str) -> Plugin:
        if self._registering is None:
            raise PluginError(
                f"{method} was called outside register(host) and unregister(host)", remedy="Call it there."
            )
        return self._registering

    def providers(self, kind: type) -> list[type[Operator]]:
        """The operators that provide a type."""
        return [cls for cls in self.operators.values() if kind in cls.provides]

    def failures(self) -> list[Plugin]:
        """The plugins that failed."""
        return [plugin for plugin in self.plugins if plugin.state == PluginState.FAILED]

    def properties(self, settings: Settings) -> dict[str, PropertyValues]:
        """Values of all operators' properties.

        Raises:
            SettingError: When a setting names an operator or property that is not there, or does not fit.
        """
        operators = self.operators
        for idname in settings:
            if idname not in operators:
                known = ", ".join(name for name, cls in operators.items() if cls.properties)
                raise SettingError(
                    "there is no such operator",
                    path=idname,
                    remedy=f"{nearest(idname, operators)}The operators with properties are: {known}.",
                )
        return {name: values_of(cls.properties, settings.get(name, {}), name) for name, cls in operators.items()}

    def plan(self, given: Iterable[type], wanted: Iterable[type], optional: Iterable[type] = ()) -> Plan:
        """Which operators run, in which order; see `plan.make_plan`."""
        broken = [f"{plugin.id} ({plugin.error})" for plugin in self.failures()]
        broken += [f"{plugin.id} (disabled)" for plugin in self.plugins if plugin.state is PluginState.DISABLED]
        return make_plan(tuple(self.operators.values()), tuple(given), tuple(wanted), tuple(optional), broken)

    def run(
        self,
        given: Iterable[object],
        wanted: Iterable[type],
        *,
        optional: Iterable[type] = (),
        settings: Settings | None = None,
        progress: Callable[[str, float, str], None] | None = None,
        reuse: Reuse | None = None,
    ) -> Run:
        """Prepare a run; iterate over what is returned to carry it out.

        Args:
            given: Values that are known, such as a `Source`.
            wanted: Types that must come out.
            optional: Types that are made where some operator can.
            settings: Values of properties.
            progress: Called with the operator's label, a fraction in 0..1 and a message.
            reuse: Called with an operator and the values so far before it runs: what it would make, where that is
                known from an earlier run, otherwise None.

        Raises:
            PlanError: When the operators cannot make what is wanted, or need each other in a circle.
            SettingError: When a setting does not fit.
        """
        data: Mapping[type, Any] = {type(value): value for value in given}
        owners = {cls.idname: plugin.id for plugin in self.plugins for cls in plugin.operators}
        plan = self.plan(data, wanted, optional)
        return Run(plan, data, self.properties(settings or {}), owners, progress, reuse)


def open_host(folders: Iterable[str | Path] = (), environment: Mapping[str, str] | None = None) -> Host:
    """A host with all plugins that can be found, registered where they can be.

    Args:
        folders: Folders that the user names, beside the bundled plugins and the installed ones.
        environment: Environment variables; the process's own when None.

    Raises:
        SettingError: When a named folder holds no plugin, or the file with the user's choices cannot be read.
    """
    host, disabled = Host(), disabled_plugins(environment)
    for location in discover(folders, environment):
        plugin = host.add(location)
        if plugin.id in disabled and plugin.state is PluginState.FOUND:
            plugin.state = PluginState.DISABLED
    for plugin in host.plugins:
        host.load(plugin)
    return host
