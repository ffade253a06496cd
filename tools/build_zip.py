"""Build the extension zip with Blender's own packager and validate it: `./dev build`.

Only files that Git knows go in: the packager works on a clean copy, so that nothing that lies about in a checkout can
reach a user.
"""

import shutil
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def packager(verb, *arguments):
    """Run Blender's extension packager, held to Blender's own list of tags (which it does not check unless told to).

    Raises RuntimeError with the packager's words when it refuses."""
    import bpy

    scripts = Path(bpy.utils.resource_path("LOCAL")) / "scripts"
    script, tags = (
        scripts / "addons_core/bl_pkg/cli/blender_ext.py",
        scripts / "modules/_bpy_internal/extensions/tags.py",
    )
    done = subprocess.run(
        [sys.executable, str(script), verb, "--valid-tags", str(tags), *map(str, arguments)],
        capture_output=True,
        text=True,
    )
    if done.returncode:
        raise RuntimeError(f"Blender's packager refuses to {verb} the extension:\n{done.stdout}{done.stderr}")


def known_files(root=ROOT):
    """Paths, relative to `root`, that Git tracks or would add."""
    listed = subprocess.run(
        ["git", "-C", str(root), "ls-files", "-z", "--cached", "--others", "--exclude-standard"],
        capture_output=True,
        check=True,
    ).stdout
    return sorted(name for name in set(listed.decode().split("\0")) if name and (root / name).is_file())


def build(out=ROOT / "build", root=ROOT):
    """Write `out`/reflect-VERSION.zip and return its path; raises RuntimeError when anything about it is not valid."""
    manifest = tomllib.loads((root / "blender_manifest.toml").read_text())
    project = tomllib.loads((root / "pyproject.toml").read_text())["project"]
    if manifest["version"] != project["version"]:
        raise RuntimeError(
            f"blender_manifest.toml says version {manifest['version']}, pyproject.toml {project['version']}. "
            "Make them equal."
        )
    with tempfile.TemporaryDirectory(prefix="reflect-build-") as folder:
        source, made = Path(folder) / "source", Path(folder) / "made"
        made.mkdir()
        for name in known_files(root):
            (source / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(root / name, source / name)
        packager("validate", source)
        packager("build", "--source-dir", source, "--output-dir", made)
        (archive,) = made.glob("*.zip")
        packager("validate", archive)
        out.mkdir(parents=True, exist_ok=True)
        target = out / archive.name
        shutil.move(archive, target)
    return target


if __name__ == "__main__":
    try:
        print(build())
    except RuntimeError as error:
        sys.exit(str(error))
