"""What a run is made of: the work on one frame, and who does it, this process or many."""
