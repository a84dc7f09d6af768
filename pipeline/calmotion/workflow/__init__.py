"""What scripts and the command line call: a shot is opened, simulated, optimised, verified or rigged.

Nothing here prints or reads arguments of a command line. `import calmotion` offers the names that users need.
"""
