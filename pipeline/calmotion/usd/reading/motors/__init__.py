"""Motor tracks: from drives, body transforms, skeletons and files; limits, and joints without a motor."""
