"""The grasp study: a filmed finger's joint angles, and the same from the path of its tip alone.

Measure a video, recover the angles from the tip's path, report. Pure but for its own files: the
command reads videos and writes reports.
"""
