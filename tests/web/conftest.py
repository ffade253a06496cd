"""Exports of contact.blend, made once: small, with every method that gathers, and pictures of its camera."""

import pytest
from node_package import chromium, need_packages
from sample_exports import SIZE, Exported, exported

from reflect_addon.core import methods as registry


@pytest.fixture(scope="session")
def drawable(device) -> None:
    """Before minutes of baking."""
    need_packages()
    chromium()


@pytest.fixture(scope="session", name="exported")
def contact(tmp_path_factory, drawable) -> Exported:
    return exported(tmp_path_factory.mktemp("web") / "contact", "contact", tuple(registry.gathering()))


@pytest.fixture(scope="session")
def compressed(tmp_path_factory, drawable) -> Exported:
    """A light field alone, in blocks."""
    return exported(tmp_path_factory.mktemp("blocks") / "contact", "contact", ("light_field",), compressed=True, views=4, view_texels=32)


@pytest.fixture(scope="session")
def upright(tmp_path_factory, drawable) -> Exported:
    """A picture of another shape than the scene's render settings have, by a lens that is shifted and fitted to its height."""
    lens = {"sensor_fit": "VERTICAL", "shift_x": 0.1, "shift_y": -0.05}
    return exported(tmp_path_factory.mktemp("upright") / "contact", "contact", ("environment",), SIZE[::-1], lens)
