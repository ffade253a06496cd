"""Rebuild the sample .blend files beside this script: all, or those named on the command line."""

import importlib
import sys

from sample_blends import scene_parts as parts

NAMES = ("teapots", "columns", "contact", "kitchen")

if __name__ == "__main__":
    for name in sys.argv[1:] or NAMES:
        importlib.import_module(f"sample_blends.build_{name}").build()
        parts.save(parts.HERE / f"{name}.blend")
        print(f"sample_blends/{name}.blend")
