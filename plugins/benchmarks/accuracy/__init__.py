"""Error against run time, tolerances, estimates, calibrations."""
