"""Which parts of the model a shot does not need, from one simulation of the rigid robot."""
