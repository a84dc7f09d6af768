"""How a recording opens: two 3D views side by side, plots in tabs below, the summary beside them."""

from __future__ import annotations

import colorsys
from dataclasses import dataclass

import rerun.blueprint as rrb
from calmotion.shot import Animation, Character, Motor, Result
from calmotion.shot.measure import measure_of
from calmotion.views.playback import sample_motion
from calmotion.views.viewpoint import choose_viewpoint

INPUT, OPTIMIZED, REFERENCE = "input", "optimized", "reference"
TIME = "time"  # the timeline of the shot
BACKGROUND = (236, 238, 241)
MOTOR_TABS = 16
# Half the vertical opening angle of rerun's eye is about 27 degrees; the radius is that of a whole box's diagonal.
DISTANCE = 1.4


@dataclass(frozen=True)
class Style:
    """Color (8 bits, safe for color-blind viewers: Okabe and Ito), line width in points, and name of a motion."""

    color: tuple[int, int, int]
    width: float
    label: str

    def shade(self, index: int, count: int) -> tuple[int, int, int]:
        """A darker or lighter relative of the color, for one of several curves."""
        hue, light, strength = colorsys.rgb_to_hls(*(c / 255.0 for c in self.color))
        spread = 0.0 if count < 2 else 0.36 * (index / (count - 1) - 0.5)
        red, green, blue = colorsys.hls_to_rgb(hue, min(max(light - spread, 0.18), 0.78), strength)
        return round(255 * red), round(255 * green), round(255 * blue)


STYLES = {
    INPUT: Style((213, 94, 0), 1.6, "before"),
    OPTIMIZED: Style((0, 114, 178), 1.6, "after"),
    REFERENCE: Style((0, 158, 115), 1.0, "intended"),
}


def make_blueprint(character: Character, animation: Animation, result: Result, scale: float) -> rrb.Blueprint:
    """The views that fit what the result holds; `scale` is the deviation of the strongest color [m]."""
    optimized = result.after is not None
    eye = choose_eye(character, animation, result)
    legend = f"intended motion: green; others coloured by error, red at {1e3 * scale:.3g} mm"
    views = [spatial_view(f"Input, simulated ({legend})", INPUT, eye)]
    if optimized:
        views.append(spatial_view(f"Optimised ({legend})", OPTIMIZED, eye))
    tabs = [plot("Position error [mm]", "errors/position_mm")]
    if any(target.rotation_weight > 0.0 for target in character.targets):
        tabs.append(plot("Rotation error [deg]", "errors/rotation_deg"))
    if character.targets:
        tabs.append(rrb.BarChartView(origin="spectra", name="Spectra [mm over Hz]"))
    if optimized:
        units = dict.fromkeys(measure_of(motor).unit for motor in character.motors)
        tabs += [plot(f"Change of the motors [{unit}]", f"changes_{unit}") for unit in units]
    tabs += [motor_tab(motor) for motor in character.motors[:MOTOR_TABS]]
    if result.before.motion.joint_forces is not None:
        tabs.append(reactions_tab())
    if result.steps:
        tabs.append(plot("Optimiser (choose the timeline: iteration)", "optimizer"))
    below = rrb.Horizontal(
        rrb.Tabs(*tabs, active_tab=0),
        rrb.TextDocumentView(origin="summary", name="Summary"),
        column_shares=[5, 3],
    )
    return rrb.Blueprint(
        rrb.Vertical(rrb.Horizontal(*views), below, row_shares=[3, 2]),
        rrb.SelectionPanel(state="hidden"),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.TimePanel(state="collapsed", timeline=TIME, loop_mode="all"),
        auto_views=False,
    )


def choose_eye(character: Character, animation: Animation, result: Result) -> rrb.EyeControls3D:
    """A camera that sees the whole motion."""
    motion = sample_motion(result.before.motion, animation.frame_times)
    view = choose_viewpoint(character, result.skins, motion)
    return rrb.EyeControls3D(
        kind=rrb.Eye3DKind.Orbital,
        position=view.center + DISTANCE * view.radius * view.toward_eye,
        look_target=view.center,
        eye_up=view.up,
    )


def spatial_view(name: str, root: str, eye: rrb.EyeControls3D) -> rrb.Spatial3DView:
    """One motion over the intended motion."""
    return rrb.Spatial3DView(
        origin="/",
        contents=[f"/{root}/**", f"/{REFERENCE}/**", f"/trails/{root}/**", f"/trails/{REFERENCE}/**"],
        name=name,
        eye_controls=eye,
        background=rrb.Background(color=BACKGROUND, kind=rrb.BackgroundKind.SolidColor),
        line_grid=rrb.LineGrid3D(visible=False),
    )


def plot(name: str, origin: str) -> rrb.TimeSeriesView:
    """Curves below one entity."""
    return rrb.TimeSeriesView(origin=origin, name=name, plot_legend=rrb.PlotLegend(rrb.Corner2D.RightTop))


def reactions_tab() -> rrb.Vertical:
    """Forces of all joints above, moments below."""
    return rrb.Vertical(
        plot("Joint forces [N]", "reactions/force_N"),
        plot("Joint moments [N m]", "reactions/moment_Nm"),
        name="Joint reactions",
    )


def motor_plots(motor: Motor) -> tuple[tuple[str, str], tuple[str, str]]:
    """Names of the entities of a motor's value and effort, and their units."""
    measure = measure_of(motor)
    effort = measure.effort_unit.replace(" ", "")
    return (f"{measure.name}_{measure.unit}", measure.unit), (f"{measure.effort}_{effort}", measure.effort_unit)


def motor_tab(motor: Motor) -> rrb.Vertical:
    """Angle (or length) above, torque (or force) below."""
    name, measure = motor.path.rsplit("/", 1)[-1], measure_of(motor)
    (value, unit), (effort, newtons) = motor_plots(motor)
    return rrb.Vertical(
        plot(f"{name}: {measure.name} [{unit}]", f"motors{motor.path}/{value}"),
        plot(f"{name}: {measure.effort} [{newtons}]", f"motors{motor.path}/{effort}"),
        name=name,
    )
