"""Registration of the lighthouses' frame to the rig's, from paint on a tracker. Pure.

`rhot calibrate objects` is the command.
"""
