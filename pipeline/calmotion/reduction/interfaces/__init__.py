"""Interface patches: the parts of a surface to which joints are attached, and their motion."""
