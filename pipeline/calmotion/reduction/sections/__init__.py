"""An equivalent frame of beams of a flexible body, from its sections: a rough answer without a mesh."""
