"""Retargeting: motor curves, objective, preconditioner and Gauss-Newton over the sweeps of `dynamics`.

From the outside: `run.simulate_shot` and `run.optimize_shot`, with `prepare.Options`, and `commanded.commanded_values`,
which tells what a result has the motors do. Importing the package alone
loads nothing.
"""
