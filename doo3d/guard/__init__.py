"""Guard the reading of untrusted files: size limits, file names, JSON, YAML, image headers, libraries that may crash.

Damaged or hostile content always raises an error of doo3d with a clear sentence; it never raises another exception, ends the
process or takes unlimited memory.
"""
