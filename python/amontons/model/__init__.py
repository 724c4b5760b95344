"""What does not change during a simulation: bodies, shapes, joints, and the builder of models."""
