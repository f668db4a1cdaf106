"""The pages, and in `generate/` what writes those that are made from the code."""
