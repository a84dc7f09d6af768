"""The plugins that come with Calmotion, each a package of this one: `calmotion_plugins.fe_mesher`, in every process.

A wheel holds their folders beside this file; a checkout holds them in its folder `plugins`.
"""

from pathlib import Path

_PARENT = Path(__file__).resolve().parents[1]
if _PARENT.name == "pipeline" and (_PARENT.parent / "pyproject.toml").is_file():
    __path__ = [str(_PARENT.parent / "plugins")]
