"""Rebuild every sample .blend beside this script, in its own process-clean file; names on the command line restrict it."""

import importlib
import sys

from sample_blends import scene_parts as parts

NAMES = ("teapots", "columns", "contact", "kitchen")

if __name__ == "__main__":
    for name in sys.argv[1:] or NAMES:
        importlib.import_module(f"sample_blends.build_{name}").build()
        parts.save(parts.HERE / f"{name}.blend")
        print(f"sample_blends/{name}.blend")
