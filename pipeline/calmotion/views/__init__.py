"""Common parts of pictures, videos and recordings: playback, viewpoint, shading, renderer, spectrum."""
