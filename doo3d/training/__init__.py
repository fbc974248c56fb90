"""Training of the network that marks thin deformable objects: drawn images with truth, the network, and its export.

Drawing needs no torch; `network`, `learning` and `export` import torch.
"""
