"""Public names of `calmotion.rigging`: each is imported when it is first used."""

from calmotion.rigging.materials import MATERIALS as MATERIALS
from calmotion.rigging.materials import Material as Material
from calmotion.rigging.materials import known_materials as known_materials
from calmotion.rigging.materials import material_named as material_named
