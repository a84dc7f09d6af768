"""Retargeting for a set of robots instead of one."""
