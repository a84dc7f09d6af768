"""Error control: what may be left out, reduction, time step, integrator, and verification of the result."""
