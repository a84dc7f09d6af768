"""Public names of `calmotion.catalogs`: each is imported when it is first used."""

from calmotion.catalogs.materials import MATERIALS as MATERIALS
from calmotion.catalogs.materials import Material as Material
from calmotion.catalogs.materials import known_materials as known_materials
from calmotion.catalogs.materials import material_named as material_named
