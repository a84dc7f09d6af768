"""The tempo at which a robot can perform an animation: slower where it must be, beats where they were."""
