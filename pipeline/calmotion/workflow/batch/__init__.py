"""Many shots as independent jobs on this machine, a Dask cluster or Slurm."""
