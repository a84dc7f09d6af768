"""Public names of `calmotion.mesh`: each is imported when it is first used."""

from calmotion.mesh.patches.contact_notes import contact_notes as contact_notes
from calmotion.mesh.patches.interface_patches import AttachmentFrame as AttachmentFrame
from calmotion.mesh.patches.named_surfaces import refuse_named_surfaces as refuse_named_surfaces
from calmotion.mesh.quadratic import QuadraticMesh as QuadraticMesh
from calmotion.mesh.sources.twins import Link as Link
from calmotion.mesh.sources.twins import twin_of as twin_of
from calmotion.mesh.surfaces.distances import triangle_parts as triangle_parts
from calmotion.mesh.tetrahedralize.tetwild import TIME_LIMIT as TIME_LIMIT
