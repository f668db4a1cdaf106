"""The bundle of the objects' registration: reprojection, noise, solution, held-out error. Pure."""
