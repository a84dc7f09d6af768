"""Run time against problem size: scaling, reduction, meshing, reading."""
