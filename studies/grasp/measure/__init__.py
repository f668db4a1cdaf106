"""A finger's joints in a video: by dots painted on them, or by the edges of a plain finger.

The way of the data: pictures.py (frames, lens corrected), dots/ or edges/ (joints in pixels),
recordings.py (angles and lengths in the finger's plane), table.py and draw.py (what people see).
"""
