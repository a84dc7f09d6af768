"""Calibration of a robot: recordings, and the parameters that they tell."""
