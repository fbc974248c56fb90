"""Estimate the motion of a camera, and open rigs of several cameras."""
