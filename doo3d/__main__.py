"""`python -m doo3d` runs the command `doo3d`."""

from .cli import process

if __name__ == "__main__":
    process()
