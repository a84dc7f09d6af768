"""Matrix-free Gauss-Newton in a trust region, its preconditioner and its steps under limits."""
