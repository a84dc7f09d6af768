"""Error against run time, tolerances, convergence of the reduction, value of simplifications."""
