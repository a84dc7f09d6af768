"""Test motions that make parameters of a robot identifiable."""
