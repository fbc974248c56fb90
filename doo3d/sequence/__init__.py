"""What the frames of one capture tell each other: tracking and fusion."""
