"""Former place of `doo3d.plugins.CUSTOM_COSTS`, which plug-ins and scripts still import from here."""

from ...plugins import CUSTOM_COSTS

__all__ = ["CUSTOM_COSTS"]
