"""Full models: links that are alike have one, and only what decides a model tells them apart."""

import threading
from dataclasses import replace

import numpy as np
import pytest
from calmotion.mesh.patches.interface_patches import AttachmentFrame
from calmotion.mesh.quadratic import quadratic_nodes
from calmotion.mesh.tetrahedra import measure_quality
from calmotion.model import Body, FEMesh, FlexibleSettings, MassProperties
from calmotion.reduction import reduce
from calmotion.reduction.cache import recomputed
from calmotion.reduction.full_models import FullModels, Member, _Room, handed_on
from calmotion.reduction.mesh_refinement import MeshController


@pytest.fixture
def member(helpers, plastic):
    points, tets = helpers.box((4, 2, 2), (0.2, 0.04, 0.04))
    points = np.asarray(points) - [0.0, 0.02, 0.02]
    mesh = FEMesh(0, points, tets, measure_quality(points, tets))
    body = Body("/Arm/link", helpers.frame(0, 0, 0), None, flexible=FlexibleSettings(plastic))
    frames = [
        AttachmentFrame("/Arm/tip", helpers.frame(0.2, 0.0, 0.0), "interface"),
        AttachmentFrame("/Arm/root", helpers.frame(0.0, 0.0, 0.0), "interface"),
    ]
    return Member(mesh, body, frames, 1)


def alike(member):
    """The same link elsewhere in a robot."""
    frames = [replace(frame, path=f"/Other{frame.path}") for frame in member.attachments]
    rest = replace(member.body.rest, position=member.body.rest.position + 1.0)
    return Member(replace(member.mesh, body=5), replace(member.body, path="/Other/link", rest=rest), frames, 1)


def with_flexible(member, **changes):
    return replace(member, body=replace(member.body, flexible=replace(member.body.flexible, **changes)))


def test_links_that_are_alike_have_one_model(member):
    models = FullModels(keeps=True)
    assert models.of(member) is models.of(alike(member))


def test_what_decides_a_model_tells_links_apart(member, helpers, plastic):
    mesh = member.mesh
    moved = replace(member.attachments[0], frame=helpers.frame(0.19, 0.0, 0.0))
    others = [
        replace(member, mesh=replace(mesh, points=mesh.points * 1.001)),
        replace(member, attachments=[moved, member.attachments[1]]),
        replace(member, root=0),
        with_flexible(member, interface_radius=0.01),
        with_flexible(member, material=replace(plastic, youngs_modulus=1.1 * plastic.youngs_modulus)),
        replace(member, body=replace(member.body, mass=MassProperties(0.4, np.zeros(3), np.eye(3)))),
    ]
    assert len({own.key for own in (member, *others)}) == 1 + len(others)


def test_threads_that_need_one_model_make_it_once(member, monkeypatch):
    made, begun, own = [], threading.Event(), reduce.full_body

    def slow(*args):
        made.append(args)
        begun.wait(30.0)
        return own(*args)

    monkeypatch.setattr(reduce, "full_body", slow)
    models, found = FullModels(keeps=True), []
    threads = [threading.Thread(target=lambda: found.append(models.of(alike(member)))) for _ in range(3)]
    for thread in threads:
        thread.start()
    begun.set()
    for thread in threads:
        thread.join()
    assert len(made) == 1 and found[0] is found[1] is found[2]


def softer(member):
    """The link with a factor of its stiffness, which is known from finer meshes."""
    return replace(member, mesh=replace(member.mesh, quality=replace(member.mesh.quality, stiffness_factor=0.8)))


def test_a_factor_of_the_stiffness_needs_no_factorisation(member, monkeypatch):
    models = FullModels(keeps=True)
    own, made = models.of(member), reduce.full_body
    monkeypatch.setattr(reduce, "full_body", None)
    scaled = models.of(softer(member))
    monkeypatch.setattr(reduce, "full_body", made)
    material = member.body.flexible.material
    weak = with_flexible(member, material=replace(material, youngs_modulus=0.8 * material.youngs_modulus))
    for found in (scaled, FullModels(keeps=True).of(softer(member)), models.of(weak)):
        stiffness = found.support.fixed(found.model).patch_stiffness()
        np.testing.assert_allclose(
            stiffness, 0.8 * own.support.fixed(own.model).patch_stiffness(), rtol=1e-9, atol=1e-6
        )


def test_models_of_other_bodies_are_let_go(member, monkeypatch):
    models, other = FullModels(keeps=True), replace(member, root=0)
    kept = models.of(member)
    models.of(other)
    few = models.only([softer(member)])
    made = []
    monkeypatch.setattr(reduce, "full_body", lambda *args: made.append(args) or kept)
    assert few.of(member) is kept and not made
    few.of(other)
    assert len(made) == 1


def test_the_model_of_a_mesh_that_was_judged_is_left_to_one_reduction(member, monkeypatch):
    handed_on.clear()
    with recomputed():
        mesh = MeshController(0.02, 15_000).refined(member.mesh, member.body, member.attachments, member.root)
    made = []
    monkeypatch.setattr(reduce, "full_body", lambda *args: made.append(args))
    told = replace(mesh, quality=replace(mesh.quality, repairs=("said later",)))
    found = FullModels(keeps=False).of(replace(member, mesh=told))
    assert len(found.model.mesh.nodes) == quadratic_nodes(mesh.points, mesh.tets) and not made
    assert handed_on.take(member.key) is None is handed_on.take(replace(member, mesh=told).key)


def test_large_models_are_worked_on_one_after_another():
    room, large = _Room(10), threading.Event()

    def work():
        with room.of(20):
            large.set()

    with room.of(6), room.of(4):
        thread = threading.Thread(target=work)
        thread.start()
        assert not large.wait(0.2)
    thread.join(30.0)
    assert large.is_set()
