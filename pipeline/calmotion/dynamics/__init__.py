"""The multibody system: state layout, inertia, joints, elimination plan, statics, BDF2, and its exact derivatives.

From the outside: `model.compile_model` makes a `Model`, `simulation.simulate` runs it, `linearization.linearize` and
`sweeps.tangent`, `sweeps.adjoint` differentiate it. Importing the package alone loads nothing.
"""
