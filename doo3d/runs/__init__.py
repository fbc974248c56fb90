"""Run the detection over every frame of a capture, in this process or in workers; runs can be interrupted and resumed."""
