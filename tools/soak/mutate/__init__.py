"""Damage: what happens to good files, at the level of bytes, of numbers, of HDF5 objects, of trees."""
