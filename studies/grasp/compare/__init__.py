"""Shapes of tip paths across people, and how many markers a finger needs."""
