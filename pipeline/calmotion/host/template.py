"""The beginning of a plugin: a folder that can be installed, with an operator, a manifest and a test that passes."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

from calmotion.host.errors import PluginError
from calmotion.version import __version__

_FILES = {
    "pyproject.toml": """\
[build-system]
requires = ["hatchling>=1.26"]
build-backend = "hatchling.build"

[project]
name = "{distribution}"
version = "0.1.0"
description = "{title}: a plugin for Calmotion"
requires-python = ">=3.11"
dependencies = ["calmotion>={calmotion}"]

# This is how Calmotion finds the plugin once it is installed.
[project.entry-points."calmotion.plugins"]
{name} = "{name}"

[tool.hatch.build.targets.wheel]
packages = ["{name}"]
""",
    "README.md": """\
# {title}

A plugin for Calmotion. It reports the peak speed of every motor of a shot.

    pip install -e .
    pytest
    calmotion plugins check {name}
    calmotion inspect SHOT --run {name}.report --set {name}.report.share=0.8
""",
    "{name}/plugin.toml": """\
id = "{name}"
version = "0.1.0"
name = "{title}"
tagline = "Tells the peak speed of every motor"
maintainer = "You"
license = "MIT"
tags = ["report"]
calmotion = ">={calmotion}"
requires = ["numpy>=2"]
""",
    "{name}/__init__.py": """\
\"\"\"Tells the peak speed of every motor.

Nothing heavy is imported here, so that Calmotion starts fast: do that in `execute`.
\"\"\"

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from calmotion.host import Host, Operator, Property, RunContext
from calmotion.model import Animation, Character


@dataclass(frozen=True)
class PeakSpeeds:
    \"\"\"What the operator provides: peak speed by the path of the motor [rad/s or m/s].\"\"\"

    values: Mapping[str, float]


class ReportSpeeds(Operator):
    \"\"\"Finds the peak speed of every motor, and warns where it comes near a limit.\"\"\"

    idname = "{name}.report"
    label = "Report peak speeds"
    requires = (Character, Animation)
    provides = (PeakSpeeds,)
    properties = (
        Property("share", float, 0.9, minimum=0.0, maximum=1.0, description="Share of a speed limit to warn from"),
    )

    @classmethod
    def poll(cls, data: Mapping[type, Any]) -> str | None:
        \"\"\"A reason why there is nothing to do, or None.\"\"\"
        animation = data.get(Animation)
        return "nothing moves" if animation is not None and len(animation.frame_times) < 2 else None

    def execute(self, context: RunContext) -> Sequence[object]:
        \"\"\"The values of `provides`, in that order.\"\"\"
        import numpy as np

        peaks = {{}}
        motors, tracks = context.get(Character).motors, context.get(Animation).tracks
        for number, (motor, track) in enumerate(zip(motors, tracks, strict=True)):
            context.progress(number / len(motors), motor.path)
            speeds = np.abs(np.diff(track.values) / np.diff(track.times))
            peak = peaks[motor.path] = float(speeds.max(initial=0.0))
            near = peak > context.properties.share * motor.max_velocity
            context.report("warning" if near else "info", f"{{motor.path}}: {{peak:.3g}} a second at most")
        return (PeakSpeeds(peaks),)


def register(host: Host) -> None:
    \"\"\"Add the operators.\"\"\"
    host.register_operator(ReportSpeeds)


def unregister(host: Host) -> None:
    \"\"\"Undo `register`.\"\"\"
    host.unregister_operator(ReportSpeeds)
""",
    "tests/test_{name}.py": """\
\"\"\"The plugin passes the checks, and its operator works; the fixtures come with Calmotion.\"\"\"

from pathlib import Path

import numpy as np
import pytest
from calmotion.testing import check_plugin, run_operator

FOLDER = Path(__file__).resolve().parents[1] / "{name}"


def test_the_plugin_passes_the_checks():
    assert check_plugin(FOLDER) == []


def test_speeds_are_found(calmotion_host, calmotion_shot):
    character, animation = calmotion_shot
    (found,) = run_operator(calmotion_host(FOLDER), "{name}.report", [character, animation])
    track = animation.tracks[0]
    expected = np.max(np.abs(np.gradient(track.values, track.times)))
    assert found.values[character.motors[0].path] == pytest.approx(expected, rel=0.05)
""",
}


def write_template(name: str, parent: Path) -> Path:
    """Write a new plugin into a new folder of its name; returns that folder.

    Raises:
        PluginError: The name is none for a plugin, or the folder is there already, or cannot be made.
    """
    if not re.fullmatch(r"[a-z][a-z0-9_]*", name):
        raise PluginError("is not a valid name for a plugin", path=name, remedy="Use a-z, 0-9 and _, a letter first.")
    folder = parent / name
    values = {
        "name": name,
        "title": name.replace("_", " ").capitalize(),
        "distribution": f"calmotion-{name.replace('_', '-')}",
        "calmotion": ".".join(__version__.split(".")[:2]),
    }
    try:
        folder.mkdir(parents=True)
    except FileExistsError:
        raise PluginError("the folder exists already", path=str(folder), remedy="Choose another name.") from None
    except OSError as error:
        raise PluginError("the folder cannot be made", path=str(folder), found=error.strerror) from error
    try:
        for file, text in _FILES.items():
            path = folder / file.format(**values)
            path.parent.mkdir(exist_ok=True)
            path.write_text(text.format(**values), encoding="utf-8")
    except OSError as error:
        shutil.rmtree(folder, ignore_errors=True)  # a half-made plugin would be found, and be in the way of the next
        raise PluginError("the folder cannot be made", path=str(folder), found=error.strerror) from error
    return folder
