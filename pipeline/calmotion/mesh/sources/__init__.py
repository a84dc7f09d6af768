"""Where the solid of a link comes from, and what is made of several or hollow ones."""
