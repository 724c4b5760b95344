"""Measurements and references of others beside us; `benchmarks/measurements.py` runs them."""
