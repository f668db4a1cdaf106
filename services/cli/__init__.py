"""The `rhot` command: each command is a file, in the room of what its user does.

What several rooms share lies here beside them. The rooms:

init      a new rig's rig.toml
live      a running rig: demo, up, router, top, session, and warm before the first start
record    a rig's messages into a file and out again: record, replay
calibrate what a rig must know about itself: calibrate ..., and the board to print
check     whether a rig.toml will do, before anything runs
offline   recordings in, results out, without a rig: simulate, track, tune
rig       this machine and the running rig, for check, init and live: place, ports, who is there
evaluate  results against the truth, as tables and as pictures: score, plot

Beside rig, only offline is used by other rooms (calibrate, evaluate); check, offline and evaluate
import no bus, clock or thread themselves. tests/test_architecture.py checks both.
"""
