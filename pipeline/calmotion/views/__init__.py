"""Common parts of pictures, videos and recordings: playback, viewpoint, shading, renderer, spectrum."""

from calmotion.public_names import public_names

__getattr__, __dir__ = public_names(__name__)
