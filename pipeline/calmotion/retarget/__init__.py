"""Retargeting: motor curves, objective, preconditioner and Gauss-Newton over the sweeps of `dynamics`.

From the outside: `run.simulate_shot` and `run.optimize_shot`, with `prepare.Options`. Importing the package alone
loads nothing.
"""
