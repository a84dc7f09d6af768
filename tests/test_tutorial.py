"""The tutorial of the Python interface: all its blocks in order, in an empty folder."""

import re


def test_the_tutorial_runs(repository, tmp_path, monkeypatch, capsys):
    pages = [(repository / "docs" / name).read_text() for name in ("tutorial_python.md", "how_to/running.md")]
    blocks = re.findall(r"```python\n(.*?)```", "\n".join(pages), re.DOTALL)
    monkeypatch.chdir(tmp_path)
    names: dict = {}
    for number, block in enumerate(blocks):
        block = block.replace('Path("samples")', f'Path("{repository}") / "samples"')
        block = block.replace('"shot.usda"', f'"{repository}/samples/lamp/lamp.usda"')
        exec(compile(block, f"block {number} of the tutorial", "exec"), names)
    printed = capsys.readouterr().out
    assert "mm before" in printed and "max_iterations" in printed
    assert {path.name for path in tmp_path.iterdir()} >= {"calm.usda", "calm_root.usda", "trajectory.csv", "table.csv"}
