"""`python -m amontons` is the command `amontons`."""

from .cli import main

main()
