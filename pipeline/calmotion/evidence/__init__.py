"""Error against run time, convergence and cost: what the claims of this package rest on."""
