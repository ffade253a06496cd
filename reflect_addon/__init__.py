"""Reflect: correct-looking reflections on shiny objects in real time, and how wrong they are."""
