"""Closings and openings of a fist in a recording of a finger, sampled, with mean and spread."""
