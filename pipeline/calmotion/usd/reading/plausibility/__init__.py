"""Values that no robot has, with the factor between units that would make them those of one."""
