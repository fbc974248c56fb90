"""Views of one scene fused to a cloud."""
