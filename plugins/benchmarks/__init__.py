"""Error against run time, how honest estimates are, and speed, measured: the command `bench`."""

from calmotion.host import registration

__all__ = ["register", "unregister"]

register, unregister = registration()
