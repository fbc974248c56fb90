"""The motion of a camera, and rigs of several cameras."""
