"""Commands on a shot: inspect, simulate, optimise."""
