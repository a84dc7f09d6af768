import numpy as np
import pytest
import synthetic
from calmotion.host import PluginError
from calmotion.model.outputs import CsvFile
from calmotion.model.run import OutputPaths
from calmotion.testing import beam, check_plugin, host_with, run_operator, small_shot

HEAD = """
    from calmotion.host import Operator, Property
    from calmotion.model import Character

    class First(Operator):
        idname, label, provides = "smithy.first", "First", (Character,)
        properties = (Property("heat", float, 1.0, description="How hot."),)
        def execute(self, context): return ()
"""
GOOD = (
    HEAD
    + """
    def register(host): host.register_operator(First)
    def unregister(host): host.unregister_operator(First)
"""
)


def test_a_good_plugin_has_no_problem(make_plugin):
    assert check_plugin(make_plugin("anvil", GOOD)) == []


@pytest.mark.parametrize(
    ("source", "problem"),
    [
        (GOOD.replace("def unregister(host): host.unregister_operator(First)", "def unregister(host): ..."), "forgets"),
        (GOOD.replace("unregister_operator(First)", "unregister_operator(Operator)"), "unregister fails"),
        (GOOD.replace('"smithy.first"', '"first"'), "idname"),
        (GOOD.replace(', description="How hot."', ""), "smithy.first.heat has no description"),
        (GOOD.replace("def unregister", "def forget"), "no function unregister"),
        ("def register(host): ...\ndef unregister(host): ...", "no operator"),
        ("1 / 0", "ZeroDivisionError"),
    ],
)
def test_a_broken_rule_is_named(make_plugin, source, problem):
    (*_, found) = check_plugin(make_plugin("anvil", source))
    assert problem in found


def test_a_folder_without_a_manifest_is_not_a_plugin(tmp_path):
    assert check_plugin(tmp_path) == ["the folder holds no plugin.toml"]


def test_one_operator_runs_on_given_values(repository, tmp_path):
    host = host_with(repository / "plugins" / "table_writer")
    paths = OutputPaths(csv=str(tmp_path / "table.csv"))
    values = [synthetic.character(), synthetic.result(), paths]
    assert run_operator(host, "table.write", values) == (CsvFile(paths.csv),)
    with pytest.raises(PluginError, match="no table is requested"):
        run_operator(host, "table.write", [*values[:2], OutputPaths()])


def test_a_host_with_a_plugin_that_fails_says_so(make_plugin):
    with pytest.raises(PluginError, match="anvil failed"):
        host_with(make_plugin("anvil", "1 / 0"))


def test_the_beam_fills_its_box_with_positive_tetrahedra_and_a_closed_surface():
    points, tets, triangles = beam((5, 2, 3))
    a, b, c, d = (points[tets[:, i]] for i in range(4))
    volumes = np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a) / 6.0
    assert volumes.min() > 0.0 and volumes.sum() == pytest.approx(0.4 * 0.04**2)
    # Divergence theorem: outward triangles enclose the same volume, and every edge is shared both ways.
    p, q, r = (points[triangles[:, i]] for i in range(3))
    assert np.einsum("ij,ij->i", p, np.cross(q, r)).sum() / 6.0 == pytest.approx(volumes.sum())
    edges = np.concatenate([triangles[:, [i, (i + 1) % 3]] for i in range(3)])
    assert set(map(tuple, edges)) == set(map(tuple, edges[:, ::-1])) and len(np.unique(edges, axis=0)) == len(edges)


def test_the_small_shot_is_consistent():
    for flexible in (False, True):
        character, animation = small_shot(flexible)
        assert [body.flexible is not None for body in character.bodies] == [False, flexible]
        assert len(animation.tracks) == len(character.motors) == 2
        for track in animation.tracks:
            assert track.values[0] == 0.0 and track.times.shape == animation.frame_times.shape
        for joint in character.joints:
            rest = character.bodies[joint.body0].rest.position if joint.body0 >= 0 else np.zeros(3)
            np.testing.assert_allclose(
                rest + joint.frame0.position, character.bodies[joint.body1].rest.position + joint.frame1.position
            )
