"""A finger's skin: how it moved between two pictures (texture.py), and where each phalanx' skin is
in every picture against what all of them show (patches.py).
"""
