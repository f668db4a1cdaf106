"""Joints that carry dots of paint: their colour, their patches, and which is which over time."""
