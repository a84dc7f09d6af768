"""What pictures and recordings share: playback of a computed motion, viewpoint, shading, spectrum."""
