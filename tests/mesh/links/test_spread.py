"""Frequencies of real links hardly depend on the mesh: elements, interface patches and extrapolation together."""

from __future__ import annotations

import pytest
from calmotion.mesh.element_sizes import element_size
from calmotion.mesh.patches.interface_patches import AttachmentFrame
from calmotion.reduction.mesh_refinement import response
from calmotion.tolerance.meshes.accurate_mesh import accurate
from calmotion.tolerance.meshes.body_mesh import geometry_of
from calmotion.tolerance.meshes.options import MeshOptions
from mesher_links import link_of

LINKS = {
    "xarm7/xarm7.usda": "link2",
    "g1_dual_arm/g1_dual_arm.usda": "left_elbow_link",
    "panda/panda.usda": "link5",
    "kuka_iiwa_14/iiwa14.usda": "link4",
    "shadow/right_shadow_hand.usda": "rh_ffproximal",
}


@pytest.mark.long
@pytest.mark.parametrize("file", LINKS)
def test_the_first_frequency_is_that_of_other_meshes(shared_data, file):
    body, frames = link_of(shared_data / "converted" / file, LINKS[file])
    attachments = [AttachmentFrame(f"joint {k}", frame, "interface") for k, frame in enumerate(frames)]
    volume = geometry_of(0, body, MeshOptions(), frames)
    size, first = element_size(volume.shape), []
    for factor in (1.25, 1.0, 0.8):
        given = (0, body, volume, factor * size, MeshOptions(), frames[0], attachments)
        mesh = accurate(*given)
        first.append(float(response(mesh, body, attachments, 0, None, 1).compliances[0] ** -0.5))
    spread = max(first) / min(first) - 1.0
    print(f"\n{LINKS[file]}: the first frequency spreads by {100.0 * spread:.2g}% over three meshes")
    assert spread < 0.02  # link2 of the xArm 1.6%, between the first and the last mesh
