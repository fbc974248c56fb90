"""Implement the commands, one file per command, with their shared options and messages."""
