"""A plain finger's joints from its edges, the paper's way (section 4), carried from picture to
picture by a chain of links with an outline.
"""
