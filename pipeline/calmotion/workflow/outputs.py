"""Files that a run writes: never over what it reads, and refused before the long work where they cannot be written."""

import os
from collections.abc import Mapping
from pathlib import Path

from calmotion.errors import file_access
from calmotion.host import Host, SettingError
from calmotion.model import Character, Provenance
from calmotion.model.outputs import CsvFile, Figures, HtmlPage, PageContent, Recording, Video, WrittenLayer
from calmotion.model.run import OutputPaths
from calmotion.support.files import try_writing
from calmotion.usd.writing.root import root_path
from calmotion.workflow.problems import value_of

_NAMES = (("-o", "layer"), ("--csv", "csv"), ("--rrd", "rrd"), ("--figures", "figures"), ("--video", "video"),
          ("--modes", "modes"), ("--html", "html"))  # fmt: skip
_FOLDERS = ("--figures", "--modes")
_ROOT = "-o, its root layer"
_KINDS = (
    (WrittenLayer, "-o", "layer"),
    (CsvFile, "--csv", "csv"),
    (Recording, "--rrd", "rrd"),
    (Figures, "--figures", "figures"),
    (Video, "--video", "video"),
)


def files_of(outputs: OutputPaths) -> dict[str, str]:
    """The file or folder of each output that is requested, by its option."""
    paths = ((option, getattr(outputs, name)) for option, name in _NAMES)
    return {option: path for option, path in paths if path is not None}


def prepare_outputs(inputs: Mapping[str, str], outputs: OutputPaths) -> None:
    """Make the folders of the outputs, so that a path that cannot be written is refused before the long work.

    Args:
        inputs: Files that the user names to be read, by what they are.
        outputs: What is requested.

    Raises:
        SettingError: An output cannot be written, or is an input or another output.
    """
    files = files_of(outputs)
    refuse_overwriting(inputs, files)
    for option, path in files.items():
        try:
            try_writing(Path(path) / "file" if option in _FOLDERS else path)
        except OSError as error:
            raise SettingError(
                "this output cannot be written",
                path=option,
                found=f"{path}: {error.strerror}",
                remedy="Choose another.",
            ) from error


def refuse_overwriting(inputs: Mapping[str, str], files: Mapping[str, str]) -> None:
    """Refuse outputs that are inputs, or each other.

    Args:
        inputs: Files that are read, by what they are: `the shot`.
        files: Files that are written, by their options.
    """
    options: dict[str, str] = {}
    if "-o" in files:
        options[_on_all_systems(root_path(files["-o"]))] = _ROOT
    for option, path in files.items():
        if (other := options.setdefault(_on_all_systems(path), option)) != option:
            raise SettingError(
                f"this is the output of {other} as well", path=option, found=path, remedy="Choose another."
            )
        for what, name in inputs.items():
            if _is_same(path, name):
                raise SettingError(
                    f"this file is read as {what}, and what is read is never overwritten",
                    path=option,
                    found=path,
                    remedy="Choose another.",
                )


def _on_all_systems(path: str) -> str:
    """What two names have in common that are one file on some systems: capitals make no difference on two of three."""
    return os.path.realpath(path).casefold()


def refuse_layers(shot: str, provenance: Provenance, character: Character | None, files: Mapping[str, str]) -> None:
    """Refuse outputs that are layers or meshes of the shot, as soon as these are known.

    Args:
        provenance: With its layers.
        character: With the mesh files of its bodies, where it was read.
        files: Files that are written, by their options.
    """
    folder = os.path.dirname(os.path.realpath(shot))
    read = {os.path.join(folder, layer.path): "layer" for layer in provenance.layers}
    bodies = () if character is None else character.bodies
    read |= {body.flexible.mesh_file: "mesh" for body in bodies if body.flexible and body.flexible.mesh_file}
    for option, path in files.items():
        for file, kind in read.items():
            if os.path.exists(file) and _is_same(path, file):
                raise SettingError(
                    f"this file is a {kind} of the shot, which is never overwritten",
                    path=option,
                    found=path,
                    remedy="Choose another.",
                )


def _is_same(one: str, other: str) -> bool:
    """Whether two names are one file, also through links."""
    if os.path.realpath(one) == os.path.realpath(other):
        return True
    return os.path.exists(one) and os.path.exists(other) and os.path.samefile(one, other)


def refuse_other_types(outputs: object) -> None:
    """Refuse outputs that are named in another way."""
    if not isinstance(outputs, OutputPaths):
        raise SettingError(
            "must be OutputPaths",
            path="outputs",
            found=repr(outputs)[:80],
            remedy='Write calmotion.OutputPaths(layer="calm.usda").',
        )


def requested_files(host: Host, outputs: OutputPaths) -> list[type]:
    """The types that the requested files are made as in the run; the page of `--html` is made of the finished run.

    Raises:
        SettingError: No plugin writes one of them.
    """
    kinds: list[type] = []
    for kind, option, name in _KINDS:
        path = getattr(outputs, name)
        if path is not None:
            _refuse_unprovided(host, kind, option, path)
            kinds.append(kind)
    if outputs.html is not None:
        _refuse_page(host, outputs.html)
    return kinds


def _refuse_page(host: Host, page: str) -> None:
    _refuse_unprovided(host, HtmlPage, "--html", page)
    if os.path.splitext(page)[1].lower() not in (".html", ".htm"):
        raise SettingError("the page is not named like one", path="--html", found=page, remedy="Name a .html file.")


def _refuse_unprovided(host: Host, kind: type, option: str, path: str) -> None:
    if not host.providers(kind):
        failed = "; ".join(f"{plugin.id}: {plugin.error}" for plugin in host.failures())
        raise SettingError(
            "no plugin writes this output",
            path=option,
            found=path,
            remedy=f"Plugins that failed: {failed}" if failed else f"Install one that provides {kind.__name__}.",
        )


def prepare_page(host: Host, page: str, inputs: Mapping[str, str]) -> None:
    """Refuse a page of `--html` that cannot be written, before the long work.

    Args:
        inputs: Files that are read, by what they are.

    Raises:
        SettingError: It cannot, no plugin writes pages, or it is one of the files that are read.
    """
    _refuse_page(host, page)
    prepare_outputs(inputs, OutputPaths(html=page))


def write_page(host: Host, page: str, content: PageContent) -> str:
    """Write a page of a result that is no motion; returns its path.

    Raises:
        RunError: It cannot be written.
    """
    return value_of(host.run([content, OutputPaths(html=page)], [HtmlPage]).finish(), HtmlPage).path


def refuse_unwritable(file: str) -> None:
    """Refuse a file that cannot be written."""
    with file_access("the file cannot be written", file, "Choose another file."):
        try_writing(file)
