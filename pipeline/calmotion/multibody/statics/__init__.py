"""Static equilibrium and consistent initial accelerations."""
