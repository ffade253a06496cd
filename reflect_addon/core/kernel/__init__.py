"""The kernel language: a recorder and its emitters."""
