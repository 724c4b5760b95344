"""The variational inequality of one time step: A, b, the cones, and how it is solved and judged."""
