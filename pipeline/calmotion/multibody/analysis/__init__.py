"""Kinematics, natural modes, reactions, dead centres, deflections, motor response."""
