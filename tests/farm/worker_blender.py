"""Stands in for a worker's Blender with Reflect on: `blender -b [FILE] --command reflect VERB ...`, by Blender as a Python module."""

import sys

from reflect_addon.cli import main

words = sys.argv[1:]
at = words.index("--command")
assert words[0] == "-b" and words[at + 1] == "reflect" and at <= 2, words
if file := words[1:at]:
    import bpy

    bpy.ops.wm.open_mainfile(filepath=file[0])
sys.exit(main(words[at + 2 :]))
