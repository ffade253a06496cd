"""contact, exported once for all tests."""

import pytest
from exports import Exported, exported

from reflect_addon.core import methods as registry


@pytest.fixture(scope="session")
def contact(tmp_path_factory, device) -> Exported:
    """Every method that gathers, and the planned one."""
    return exported(tmp_path_factory.mktemp("godot") / "contact", "contact", (*registry.gathering(), registry.AUTO))
