"""The constant parts of a simulation: bodies, shapes, joints, and the builder of models."""
