"""The parameters of a hand from any motion of its painted landmarks: nobody follows a guide. Pure.

`rhot calibrate hand --free` and `--watch` are the commands; the page's hand step has it, too.
"""
