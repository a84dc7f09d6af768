"""The histogram of estimates counts every shot, those beyond its axis too."""

import numpy as np
from calmotion.benchmarks.accuracy import figures
from calmotion.benchmarks.accuracy.figures import draw_estimates


def test_every_shot_is_in_the_histogram(monkeypatch, tmp_path):
    drawn = []
    monkeypatch.setattr(
        figures, "_saved", lambda figure, panel, folder, name: drawn.append(figure) or f"{folder}/{name}"
    )
    path = draw_estimates(str(tmp_path), [1e-4, 0.3, 0.4, 0.9, 1.2, 50.0], [True, True, False, True, True, False])
    assert path == f"{tmp_path}/estimates"
    (panel,) = drawn[0].axes
    decided, undecided = (sum(bar.get_height() for bar in bars) for bars in panel.containers)
    assert (decided, undecided) == (4, 2)
    limits = [line.get_xdata()[0] for line in panel.lines]
    assert limits == [1.5] and np.allclose(panel.get_xlim(), (0.01, 10.0))
    assert [text.get_text() for text in panel.get_legend().get_texts()] == [
        "4 shots", "2 whose reference decides nothing"
    ]  # fmt: skip
