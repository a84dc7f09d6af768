"""The parser of arguments: a wrong option or command is answered with the nearest right one."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from typing import Any

from calmotion.support.naming import nearest


class Parser(argparse.ArgumentParser):
    """Parser of a command, which refuses its own wrong options."""

    def parse_known_args(  # type: ignore[override]
        self, args: Sequence[str] | None = None, namespace: Any = None
    ) -> tuple[Any, list[str]]:
        """The arguments; those that no option takes are refused here, where the options are known."""
        found, rest = super().parse_known_args(args, namespace)
        wrong = next((text for text in rest if text.startswith("-")), None)
        if wrong is not None:
            name = wrong.partition("=")[0]
            self.error(f"there is no option {name}. {nearest(name, self._option_string_actions)}")
        return found, rest

    def _check_value(self, action: argparse.Action, value: Any) -> None:
        try:
            super()._check_value(action, value)
        except argparse.ArgumentError as error:
            near = nearest(str(value), map(str, action.choices or ()))
            raise argparse.ArgumentError(action, f"{error.message}. {near}" if near else error.message) from None
