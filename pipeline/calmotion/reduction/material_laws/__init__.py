"""Choice of the elastic law of a body, and the reduced energies of nonlinear laws."""
