"""Curves, spectra and progress in the recording."""

import numpy as np
import pytest
import synthetic
from calmotion.views.spectrum import error_spectrum
from recordings import read_recording, tensor_of, write


def test_errors_and_motor_curves_have_the_units_they_are_named_by(columns):
    result = synthetic.result()
    first = int(np.searchsorted(result.before.motion.times, -1e-9))
    for root, simulation in (("input", result.before), ("optimized", result.after)):
        times, values = columns[f"/errors/position_mm/{root}/Robot/Tip/Target", "Scalars:scalars"]
        assert times[0] == 0.0 and times[-1] == pytest.approx(1.0)
        np.testing.assert_allclose(np.ravel(values), 1e3 * simulation.position_errors[first:, 0])
        values = columns[f"/errors/rotation_deg/{root}/Robot/Tip/Target", "Scalars:scalars"][1]
        np.testing.assert_allclose(np.ravel(values), np.degrees(simulation.rotation_errors[first:, 0]))
        values = columns[f"/motors/Robot/Joints/Swing/angle_deg/{root}", "Scalars:scalars"][1]
        np.testing.assert_allclose(np.ravel(values), np.degrees(simulation.motion.motor_values[first:, 0]))
        values = columns[f"/motors/Robot/Joints/Swing/torque_Nm/{root}", "Scalars:scalars"][1]
        np.testing.assert_allclose(np.ravel(values), simulation.motion.motor_efforts[first:, 0])
        for name, reaction in (
            ("force_N", simulation.motion.joint_forces),
            ("moment_Nm", simulation.motion.joint_moments),
        ):
            values = columns[f"/reactions/{name}/Robot/Joints/Weld/{root}", "Scalars:scalars"][1]
            np.testing.assert_allclose(np.ravel(values), np.linalg.norm(reaction[first:, 2], axis=1))
    change = np.ravel(columns["/changes_deg/Robot/Joints/Swing", "Scalars:scalars"][1])
    assert change.max() == pytest.approx(np.degrees(0.01), rel=1e-3)


def test_spectra_are_bars_in_millimetres_over_hertz(columns):
    result = synthetic.result()
    for root, simulation in (("input", result.before), ("optimized", result.after)):
        entity = f"/spectra/{root}/Robot/Tip/Target"
        frequencies, amplitudes = error_spectrum(simulation.motion, result.reference, 0)
        (bars,), (abscissa,) = (columns[entity, f"BarChart:{name}"][1][0] for name in ("values", "abscissa"))
        values = np.array(tensor_of(bars))
        assert 10 < len(values) < len(frequencies)
        np.testing.assert_allclose(values, 1e3 * amplitudes[1 : len(values) + 1])
        np.testing.assert_allclose(tensor_of(abscissa), frequencies[1 : len(values) + 1])


def test_progress_is_a_series_over_iterations(columns):
    times, values = columns["/optimizer/log10_objective", "Scalars:scalars"]
    assert times.tolist() == [0, 1, 2, 3]
    np.testing.assert_allclose(np.ravel(values), [-2.0, -3.0, -4.0, -5.0])


def test_a_simulation_alone_logs_nothing_as_optimised(tmp_path):
    write(tmp_path / "out.rrd", synthetic.result(optimized=False))
    entities = {entity for entity, _ in read_recording(tmp_path / "out.rrd")}
    assert not [e for e in entities if "optimize" in e or "change" in e]
    assert "/input/Robot/Link/Beam" in entities and "/reference/input/Robot/Link/Beam" in entities


def test_long_curves_are_thinned_and_the_frames_kept(tmp_path):
    write(tmp_path / "out.rrd", synthetic.result(), {"rerun.log": {"samples_per_plot": 50}})
    columns = read_recording(tmp_path / "out.rrd")
    times = columns["/errors/position_mm/input/Robot/Tip/Target", "Scalars:scalars"][0]
    assert 25 < len(times) <= 50
    assert len(columns["/input/Robot/Tip", "Transform3D:translation"][0]) == synthetic.FRAMES
