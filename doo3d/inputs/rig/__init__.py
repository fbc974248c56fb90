"""Read rigs of calibrated cameras: calibration files, images, and the rectification of a stereo pair."""
