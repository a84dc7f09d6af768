"""Common parts of pictures and recordings: playback of a computed motion, viewpoint, shading, spectrum."""
