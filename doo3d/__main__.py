"""`python -m doo3d` runs the command `doo3d`."""

from .cli import main

if __name__ == "__main__":
    main()
