"""The benchmark of both adjoints, on a small shot."""

import pytest
from calmotion_plugins.benchmarks.optimizer import gradients
from made_shots import plastic_shot


@pytest.mark.long
def test_the_discrete_adjoint_is_exact_and_the_continuous_one_of_second_order(monkeypatch):
    monkeypatch.setattr(gradients, "DIRECTIONS", 2)
    monkeypatch.setattr(gradients, "REPEATS", 1)
    found = gradients.errors("arm", plastic_shot(), (1, 2))
    rows = {(row.adjoint, round(240 * row.step_s * 2)): row for row in found}
    assert len(rows) == 4
    for step in (1, 2):
        exact, other = rows["discrete", step], rows["continuous", step]
        assert exact.same_step < max(1e-7, 2 * exact.floor) and exact.floor < 1e-6
        assert 1e2 * exact.same_step < other.same_step < 1e-3
        # against the fine limit the step counts, and not which adjoint
        assert 0.8 < other.fine / exact.fine < 1.25
    assert rows["continuous", 1].same_step < 0.45 * rows["continuous", 2].same_step
    assert gradients.cells(found)[0][:2] == ["discrete", "1/240 s"]
