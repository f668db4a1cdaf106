"""Hands, paints, lights, pictures and motions that no constant was chosen on: cases with truth."""
