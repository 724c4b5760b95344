"""When something is hit."""

from __future__ import annotations

from ..simulation.simulation import Simulation


def touched(sim: Simulation, body: int) -> bool:
    """Whether a contact pushed the body in the last step."""
    contacts = sim.contacts
    of_body = (contacts["body_a"] == body) | (contacts["body_b"] == body)
    return bool((contacts["state"][of_body] != "open").any())
