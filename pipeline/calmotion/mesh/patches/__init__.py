"""Where joints and loads hold a link: interface patches."""
