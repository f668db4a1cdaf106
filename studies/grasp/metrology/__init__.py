"""Single-view metrology: lengths and angles in a plane from one picture (Criminisi, Reid &
Zisserman 2000; the finger paper's A2).
"""
