import small_shots as shots
from calmotion.host import Host
from calmotion.model import Animation, Character, Provenance, Result
from calmotion.model.outputs import WrittenLayer
from calmotion.model.run import OutputPaths, RunSettings, Source
from calmotion.testing import host_with


def test_operator_is_left_out_without_a_path(repository):
    host: Host = host_with(repository / "plugins" / "usd_writer")
    cls = host.operators["usd.write"]
    assert "no layer" in cls.poll({OutputPaths: OutputPaths()})
    assert cls.poll({OutputPaths: OutputPaths(layer="calm.usda")}) is None
    assert cls.requires == (Character, Animation, Provenance, Result, OutputPaths)


def test_simulation_and_writer_run_together_from_a_shot_on_disk(repository, tmp_path):
    plugins = repository / "plugins"
    names = ("usd_reader", "body_reduction", "vibration_optimizer", "usd_writer")
    host = host_with(*(plugins / name for name in names))
    shot = shots.write_arm(tmp_path / "shot.usda")
    run = host.run(
        [Source(str(shot), "simulate", RunSettings(step=0.01)), OutputPaths(layer=str(tmp_path / "out.usda"))],
        [WrittenLayer],
    )
    results = {result.idname: result.outcome for result in run}
    assert results["usd.write"] == "done"
    assert (tmp_path / "out.usda").is_file() and (tmp_path / "out_root.usda").is_file()
