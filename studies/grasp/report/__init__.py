"""Figures, tables and pages of a grasp study. Needs the extra `study` (matplotlib)."""
