"""Labelled photographs for the 2-D mode: reading them, scoring, tables and pictures."""
