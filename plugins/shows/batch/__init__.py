"""Many shots as independent jobs on this machine or a Dask cluster."""
