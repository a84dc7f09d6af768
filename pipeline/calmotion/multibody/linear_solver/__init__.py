"""Solution of a step's linear system along the tree, with closed chains as a border."""
