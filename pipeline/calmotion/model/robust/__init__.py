"""Robots that differ from the model: what is not known of them, and how motor curves do on them."""
