"""Train the network that segments thin deformable objects: drawn images with truth, network, and export.

Drawing does not need torch; `network`, `learning` and `export` import it.
"""
