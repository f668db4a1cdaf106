"""`rhot grasp`: the grasp study, from a filmed finger to a report."""
