"""What is played, in rerun: into a recording, or to a viewer that shows it as it happens."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from calmotion.arrays import Array
from calmotion.host import SettingError
from calmotion.model import measure_of
from calmotion.multibody import rigid_poses, target_frames
from calmotion.support import try_writing

from .lines import Sink
from .session import Live

TIME = "time"
VIEWER = "rerun+"  # how places of viewers begin
COLORS = {"as sent": (213, 94, 0), "command": (0, 114, 178)}


class Viewer(Sink):
    """Sends commands on, and shows samples and commands: curves of all motors, the robot as lines from joint to joint.

    Args:
        place: A file, or that of a viewer (`rerun+http://127.0.0.1:9876/proxy`).
        sink: Where the commands go as well.
        live: The robot that is streamed to.

    Raises:
        SettingError: The place cannot be written.
    """

    FRAME_S = 0.04  # between two pictures; the curves have every tick

    def __init__(self, place: str, sink: Sink, live: Live):
        self._sink, self._live = sink, live
        self._recording = rr.RecordingStream("calmotion_live")
        blueprint = _blueprint(live)
        if place.startswith(VIEWER):
            self._recording.connect_grpc(place, default_blueprint=blueprint)
        else:
            try:
                try_writing(place)
            except OSError as error:
                raise SettingError(
                    "this recording cannot be written",
                    path="--rrd",
                    found=f"{place}: {error.strerror}",
                    remedy="Choose another file, or a viewer: rerun+http://127.0.0.1:9876/proxy",
                ) from error
            self._recording.save(place, default_blueprint=blueprint)
        for motor in live.character.motors:
            for name, color in COLORS.items():
                style = rr.SeriesLines(colors=[color], names=[name])
                self._recording.log(f"motors{motor.path}/{name}", style, static=True)
        self._rows: list[tuple[float, dict[str, Array]]] = []

    def send(self, time_s: float, commands: Mapping[str, float], live: Live) -> None:
        """One tick's commands, which are also kept for the next picture."""
        self._sink.send(time_s, commands, live)
        values = {"as sent": live.played.copy(), "command": np.array([commands[path] for path in live.joints])}
        self._rows.append((time_s, values))
        if self._rows[-1][0] - self._rows[0][0] >= Viewer.FRAME_S - 0.5 * live.tick_s:
            self._draw()

    def close(self) -> None:
        """Draw what is left, and complete the file."""
        self._draw()
        self._recording.flush()
        self._recording.disconnect()
        self._sink.close()

    def _draw(self) -> None:
        if not self._rows:
            return
        times = rr.TimeColumn(TIME, duration=[row[0] for row in self._rows])
        for name in COLORS:
            for k, motor in enumerate(self._live.character.motors):
                values = [measure_of(motor).factor * float(angles[name][k]) for _, angles in self._rows]
                columns = rr.Scalars.columns(scalars=values)
                self._recording.send_columns(f"motors{motor.path}/{name}", [times], columns)
        self._recording.set_time(TIME, duration=self._rows[-1][0])
        for name, color in COLORS.items():
            lines, points = _figure(self._live, self._rows[-1][1][name])
            self._recording.log(f"robot/{name}/links", rr.LineStrips3D(lines, colors=[color]))
            targets = rr.Points3D(points, colors=[color], radii=rr.Radius.ui_points(4.0))
            self._recording.log(f"robot/{name}/targets", targets)
        self._rows.clear()


def _figure(live: Live, angles: Array) -> tuple[list[Array], Array]:
    """Lines from the joints to those that they carry, and places of the targets, of a rigid robot in a pose [m]."""
    model, system = live.model, live.model.system
    c, q = rigid_poses(model, model.joint_angles(angles)[None], live.world[None])
    places = target_frames(model, c, q, np.zeros((1, len(system.parent), system.size)))[0][0]
    lines = [np.stack([c[0, above], c[0, b]]) for b, above in enumerate(system.parent) if above >= 0]
    lines += [np.stack([c[0, b], place]) for b, place in zip(model.targets.component, places, strict=True)]
    return lines, places


def _blueprint(live: Live) -> Any:
    lines, points = _figure(live, live.start)
    places = np.concatenate([*lines, points]) if lines else np.zeros((1, 3))
    center, size = 0.5 * (places.min(axis=0) + places.max(axis=0)), max(float(np.ptp(places, axis=0).max()), 0.1)
    eye = rrb.EyeControls3D(position=center + size * np.array([1.2, -1.8, 0.7]), look_target=center, eye_up=(0, 0, 1))
    plots = []
    for motor in live.character.motors:
        name = f"{motor.path.rpartition('/')[2]} [{measure_of(motor).unit}]"
        plots.append(rrb.TimeSeriesView(origin=f"motors{motor.path}", name=name))
    robot = rrb.Spatial3DView(origin="robot", name="Samples (orange) and commands (blue)", eye_controls=eye)
    return rrb.Blueprint(
        rrb.Horizontal(robot, rrb.Tabs(*plots)),
        rrb.SelectionPanel(state="hidden"),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.TimePanel(state="collapsed", timeline=TIME),
        auto_views=False,
    )
