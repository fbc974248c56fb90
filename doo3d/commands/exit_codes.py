"""Define the exit codes of the commands; 0 is success."""

SOME_FAILED = 1
"""Exit code if some frames failed, or compared results differ."""

NOTHING_DONE = 2
"""Exit code if nothing was done: the input or the options cannot be used, or every frame failed."""

INTERRUPTED = 130
"""Exit code after Ctrl-C; by convention 128 plus the number of the signal SIGINT."""

TERMINATED = 143
"""Exit code if another program, such as a scheduler, ended the run: 128 plus the number of the signal SIGTERM."""
