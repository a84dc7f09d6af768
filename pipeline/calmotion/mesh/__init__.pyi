"""Public names of `calmotion.mesh`: each is imported when it is first used."""

from calmotion.mesh.element_sizes import element_size as element_size
from calmotion.mesh.element_sizes import shape_of as shape_of
from calmotion.mesh.mass import joined_surfaces as joined_surfaces
from calmotion.mesh.patches.contact_notes import contact_notes as contact_notes
from calmotion.mesh.patches.contact_place import contact_place as contact_place
from calmotion.mesh.patches.interface_patches import AttachmentFrame as AttachmentFrame
from calmotion.mesh.patches.interface_patches import interface_patches as interface_patches
from calmotion.mesh.patches.named_surfaces import refuse_named_surfaces as refuse_named_surfaces
from calmotion.mesh.quadratic import QuadraticMesh as QuadraticMesh
from calmotion.mesh.quadratic import quadratic_mesh as quadratic_mesh
from calmotion.mesh.quadratic import quadratic_nodes as quadratic_nodes
from calmotion.mesh.sources.choice import solid_of as solid_of
from calmotion.mesh.sources.twins import Link as Link
from calmotion.mesh.sources.twins import twin_of as twin_of
from calmotion.mesh.surfaces.distances import triangle_parts as triangle_parts
from calmotion.mesh.tetrahedra import boundary_triangles as boundary_triangles
from calmotion.mesh.tetrahedralize.tetwild import TIME_LIMIT as TIME_LIMIT
