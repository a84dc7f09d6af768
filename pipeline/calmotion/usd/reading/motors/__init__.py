"""Motor tracks: from drives, body transforms, skeletons and files; gears and limits."""
