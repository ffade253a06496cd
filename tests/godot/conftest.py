"""contact, exported once for all tests."""

import pytest
from godot_program import need_godot
from sample_exports import Exported, exported

from reflect_addon.core import methods as registry


@pytest.fixture(scope="session")
def drawable(device) -> None:
    """Before minutes of baking."""
    need_godot()


@pytest.fixture(scope="session")
def contact(tmp_path_factory, drawable) -> Exported:
    """Every method that gathers, and the planned one."""
    return exported(tmp_path_factory.mktemp("godot") / "contact", "contact", (*registry.gathering(), registry.AUTO))
