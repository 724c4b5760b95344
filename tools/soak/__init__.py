"""The soak: random damage and misuse against the package, in processes of their own, until nothing gives.

`PYTHONPATH=tools python -m soak --seed 1 --seconds 120`; `make soak` is the long run. See README.md.
"""
