"""What a motor is beside its curve: its model, gains, rotor, and the real motor that a joint names."""
