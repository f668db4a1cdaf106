"""A finger's angles from the path of its tip alone, by the methods that the study compares."""
