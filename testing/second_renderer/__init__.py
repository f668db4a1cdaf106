"""Pictures of hands by VTK, which share no code with the simulator; clips.py has cases."""
