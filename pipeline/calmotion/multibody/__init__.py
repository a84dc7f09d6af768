"""The differential-algebraic system of rigid and reduced flexible bodies, its integrators and derivatives.

For who has arrays and no USD (docs/tutorial_multibody.md): `Mechanism` builds a `Model` of bodies, joints and motors;
`simulate` runs it, `linearize` gives the derivative (`jvp`, `vjp`), `natural_modes` its frequencies. Each name is
imported when it is first used.
"""

from calmotion.public_names import public_names

__getattr__, __dir__ = public_names(__name__)
