"""The parameters of a person's hand from a recording of its painted landmarks. Pure.

`rhot calibrate hand` is the command.
"""
