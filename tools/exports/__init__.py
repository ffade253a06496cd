"""Exports of the samples as other programs draw them, held against `render`: `./dev exports`.

node_package.py is the browser's side (Godot's is tools/godot.py), compared.py the pictures of two programs, measured.py a scene's rows; __main__.py writes what ./dev report shows.
"""
