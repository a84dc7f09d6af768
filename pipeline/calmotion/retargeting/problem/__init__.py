"""The retargeting problem: offset splines, objective, limits."""
