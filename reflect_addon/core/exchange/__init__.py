"""What leaves Blender: a folder with which another program shows the reflections (docs/export-format.md).

    with whole_folder(target) as folder: ... write_manifest(manifest, folder)
    export = read_export(folder)                  # checked: manifest.py, checked.py
    asset = ...                                   # scene/import_assets.py decodes its images
"""
