"""Recordings of whole hands as recordings of one finger in its plane of flexion."""
