"""The `rhot` command: each command is a file, in the room of what its user does.

What several rooms share lies here beside them; docs/architecture.md says what each room is for.
recorded, rig, offline, live, video and evaluate serve other rooms too, and none of these serves
them back. check, offline and evaluate import no bus, clock or thread themselves. The tests of the
house check both (tests/test_architecture.py, tests/test_purity.py).
"""
