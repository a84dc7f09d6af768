"""Commands for the installation: benchmarks, plugins, caches, checks, completion."""
