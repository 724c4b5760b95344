"""Tables and figures: what the command line shows, usable from Python too."""
