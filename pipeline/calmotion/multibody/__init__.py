"""The differential-algebraic system of rigid and reduced flexible bodies, its integrators and derivatives."""
