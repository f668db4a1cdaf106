"""A plain finger's joints: by its outline and its skin over all pictures (finder.py), and the
paper's way (section 4, paper.py), from regions between lines along its edges.
"""
