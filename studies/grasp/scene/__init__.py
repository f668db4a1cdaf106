"""Rendered experiments: a finger that closes in front of a camera, with everything known of it."""
