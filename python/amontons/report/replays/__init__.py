"""Recordings as pictures, movies, scenes of USD and tables."""
