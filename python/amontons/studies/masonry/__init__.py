"""Blocks that touch: whether they stand, by which margin, and what falls if they do not."""
