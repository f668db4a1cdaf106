"""Pictures of hands by VTK, which share no code with the simulator; see clips.py."""
