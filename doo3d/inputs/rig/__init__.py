"""Rigs of several calibrated cameras: their calibration files, their images, and the rectification of a pair."""
