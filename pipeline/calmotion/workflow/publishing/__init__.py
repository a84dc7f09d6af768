"""Manifests of results, and what must hold before a result is published."""
