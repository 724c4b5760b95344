"""A model in motion: its state, its steps, and what a step tells."""
