"""Linearisation, tangent (JVP), discrete adjoint (VJP), periodic motion, continuous adjoint."""
