"""Panels and preferences: what the user sees; no logic."""
