"""Checks of a shot before the costly work: what the reader refuses, rules about our schemas, and USD's own validators.

Ours are registered in USD's validation framework as well, so that any tool that runs it in a process with Calmotion
runs them.
"""

from calmotion.usd.validation.run import register_validators, validate_shot

__all__ = ["register_validators", "validate_shot"]
