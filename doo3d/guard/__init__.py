"""What is read from outside passes here: limits, text, JSON, YAML, image headers, libraries that may end the process.

The rule: damaged or hostile content is an error of doo3d with a sentence, never another exception, an ended process, or memory
without bound.
"""
