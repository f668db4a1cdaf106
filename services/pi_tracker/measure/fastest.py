"""Centroids by the fastest form that this machine has: compiled, else in Python. Pure."""

from __future__ import annotations

from services.pi_tracker.measure import centroid, centroid_compiled

centroids = centroid_compiled.centroids or centroid.centroids
