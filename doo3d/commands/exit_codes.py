"""Exit codes of the commands; 0 is success."""

SOME_FAILED = 1
"""Some frames failed, or the results compared differ."""

NOTHING_DONE = 2
"""Nothing was done: the input or the options cannot be used, or every frame failed."""

INTERRUPTED = 130
"""The user has pressed Ctrl-C; by convention 128 and the number of the signal SIGINT."""

TERMINATED = 143
"""Another program, such as a scheduler, has ended the run: 128 and the number of the signal SIGTERM."""
