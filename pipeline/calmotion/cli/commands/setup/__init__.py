"""Commands for the installation: plugins, caches, checks, completion."""
