"""How a recording opens: two 3D views side by side, plots in tabs below, the summary beside them."""

import numpy as np
import rerun.blueprint as rrb
from calmotion.model import Animation, Character, Motor, Result, Simulation, measure_of
from calmotion.views import choose_viewpoint, eye_that_sees, framed, sample_motion

from .colors import BACKGROUND, Style

INPUT, OPTIMIZED, REFERENCE = "input", "optimized", "reference"
TIME = "time"  # the timeline of the shot
ALONE = "as animated"  # name of curves that have none to be compared with
SCENERY = "scenery"
MOTOR_TABS = 16
# Of rerun's eye, and of the narrowest 3D view of a usual window, with a margin for titles and buttons.
HALF_ANGLE = np.radians(24.0)
ASPECT = 1.05


STYLES = {
    INPUT: Style((213, 94, 0), 1.6, "before"),
    OPTIMIZED: Style((0, 114, 178), 1.6, "after"),
    REFERENCE: Style((0, 158, 115), 1.0, "intended"),
}


def make_blueprint(character: Character, animation: Animation, result: Result, scale: float) -> rrb.Blueprint:
    """The views that fit what the result holds; `scale` is the deviation of the strongest color [m]."""
    optimized = result.after is not None
    eye = choose_eye(character, animation, result)
    legend = f"green: intended, full orange: {1e3 * scale:.3g} mm off"
    views = [spatial_view(f"As animated{_farthest(result.before)} ({legend})", INPUT, eye)]
    if result.after is not None:
        views.append(spatial_view(f"Optimised{_farthest(result.after)} (same colours)", OPTIMIZED, eye))
    tabs = [plot("Position error [mm]", "errors/position_mm")]
    if any(target.rotation_weight > 0.0 for target in character.targets):
        tabs.append(plot("Rotation error [deg]", "errors/rotation_deg"))
    if character.targets:
        tabs.append(rrb.BarChartView(origin="spectra", name="Spectra [mm over Hz]"))
    if result.retimed is not None and result.retimed.animation.tempo is not None:
        reasons = rrb.TextLogView(origin="tempo_reasons", name="Why it is slower")
        tabs.append(rrb.Vertical(plot("Tempo [%]", "tempo"), reasons, name="Tempo"))
    if optimized:
        units = dict.fromkeys(measure_of(motor).unit for motor in character.motors)
        tabs += [plot(f"Change of the motors [{unit}]", f"changes_{unit}") for unit in units]
    tabs += [motor_tab(motor) for motor in character.motors[:MOTOR_TABS]]
    if result.before.motion.joint_forces is not None:
        tabs.append(reactions_tab())
    if result.search.steps:
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


def _farthest(run: Simulation) -> str:
    """The largest error of a target, for a title; nothing without targets."""
    errors = run.position_errors[run.motion.judged]
    return f": targets up to {1e3 * float(errors.max()):.3g} mm off" if errors.size else ""


def choose_eye(character: Character, animation: Animation, result: Result) -> rrb.EyeControls3D:
    """A camera that sees all motions from beginning to end."""
    times = animation.frame_times
    runs = [result.reference, *(run.motion for run in (result.before, result.after) if run is not None)]
    motions = [sample_motion(motion, times) for motion in runs]
    view = choose_viewpoint(character, result.skins, motions[1])
    eye, look = eye_that_sees(view, framed(view, character, result.skins, motions), HALF_ANGLE, ASPECT)
    return rrb.EyeControls3D(kind=rrb.Eye3DKind.Orbital, position=eye, look_target=look, eye_up=view.up)


def spatial_view(name: str, root: str, eye: rrb.EyeControls3D) -> rrb.Spatial3DView:
    """One motion over the intended motion."""
    trails = [f"/trails/{root}/**", f"/trails/{REFERENCE}/{root}/**"]
    return rrb.Spatial3DView(
        origin="/",
        contents=[f"/{root}/**", f"/{REFERENCE}/{root}/**", *trails, f"/{SCENERY}/**"],
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
