"""Diagnose a recording: the command as a function."""

import os
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

from calmotion.host import open_host
from calmotion.model import Animation, Character, RunSettings, Source
from calmotion.recordings import measured_prims, read_recordings, refuse_unknown_channels
from calmotion.simulation import CompiledShot
from calmotion.version import __version__
from calmotion.workflow import (
    Given,
    Hooks,
    Path,
    Progress,
    Shot,
    carry_out,
    plain,
    read_settings,
    with_shot,
)

from .comparison import Diagnosis, diagnosis_of, of_spectrum
from .formats import is_dataset, is_spectrum, read_dataset
from .opening import refuse_incomparable, situation_of


@dataclass(frozen=True, eq=False)
class DiagnosedShot:
    """What a recording shows.

    Attributes:
        diagnosis: The causes, and what they are found from.
        figures: Paths of the figures.
        total_wall_s: Time of all of it [s].
    """

    diagnosis: Diagnosis
    figures: tuple[str, ...]
    total_wall_s: float

    def draw(self, folder: Path) -> tuple[str, ...]:
        """Draw motion and error in time, spectra, and the error over speed and torque; returns the paths.

        Raises:
            ShotError: They cannot be written.
        """
        from .drawing import draw_diagnosis

        return tuple(draw_diagnosis(os.fspath(folder), self.diagnosis))

    def report(self) -> dict[str, Any]:
        """The object that `--json` prints."""
        found = self.diagnosis
        report: dict[str, Any] = plain(
            {
                "command": "diagnose",
                "version": __version__,
                "causes": [vars(cause) for cause in found.causes],
                "tells": found.tells,
                "channels": found.channels,
                "model": found.situation is not None and found.situation.known,
                "notes": found.notes,
                "figures": self.figures,
                "html": None,  # a page has words of this report, and is written after it
                "total_wall_s": self.total_wall_s,
            }
        )
        return report


# parameters: one for each option of the command, all but the shot and the recordings by keyword
def diagnose(
    shot: Shot | Path | None,
    recordings: Sequence[Path] | Path,
    *,
    commands: Path | None = None,
    figures: Path | None = None,
    settings: Given = None,
    progress: Callable[[Progress], None] | None = None,
    on_operator: Callable[[Any], None] | None = None,
    cancel: Callable[[], bool] | None = None,
) -> DiagnosedShot:
    """Say what makes a robot shake, from recordings of one performance.

    Args:
        shot: The robot with the motion that it was to perform, or its USD file; None: only signals are known.
        recordings: Files, each as FILE or FILE@/PRIM; their clocks begin with the first frame, or with `commands`.
        commands: File with the commands as they were sent, `<joint path>.angle`, on the clock of the recordings.
        figures: Folder for figures.
        settings, progress, on_operator, cancel: As of `simulate`.

    Raises:
        ShotError: The shot cannot be processed, or a recording does not fit it.
        SettingError: An argument does not fit.
    """
    begin = time.perf_counter()
    chosen, hooks = read_settings(settings), Hooks(progress, on_operator, cancel)
    files = [recordings] if isinstance(recordings, (str, os.PathLike)) else recordings
    if shot is not None:
        shot = shot.unread() if isinstance(shot, Shot) else Shot(with_shot(os.fspath(shot)))
    host = open_host([]) if shot is None else shot.host
    names = [os.fspath(file) for file in files]
    if len(names) == 1 and is_spectrum(names[0]):
        return DiagnosedShot(of_spectrum(names[0]), (), time.perf_counter() - begin)
    sent = None if commands is None else read_recordings(host, [os.fspath(commands)], chosen)[0]
    if len(names) == 1 and is_dataset(names[0]):
        moved, asked = read_dataset(names[0])
        read, sent = [moved], sent or asked
    else:
        read = [*read_recordings(host, names, chosen)]
    compiled = None
    if shot is not None:
        source = Source("", "", RunSettings(), measured=measured_prims(read))
        run = partial(carry_out, shot, "simulate", source=source, settings=chosen, hooks=hooks)
        # before meshes are made, which takes much longer
        refuse_unknown_channels(
            run(wanted=(Character,)).require(Character), [*read, *([sent] if sent is not None else [])]
        )
        refuse_incomparable(read)
        # on the first meshes: frequencies of links are fitted, so that finer ones tell no more
        compiled = run(wanted=(Character, Animation, CompiledShot)).require(CompiledShot)
    situation = situation_of(compiled, read, sent)
    made = DiagnosedShot(diagnosis_of(situation, partial(hooks.tell, "Compare explanations")), (), 0.0)
    drawn = () if figures is None else made.draw(figures)
    return DiagnosedShot(made.diagnosis, drawn, time.perf_counter() - begin)
