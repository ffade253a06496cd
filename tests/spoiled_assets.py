"""What the tests of damaged assets ask for, whatever is damaged."""

import pytest

from reflect_addon.core.asset_files import load_asset
from reflect_addon.core.errors import ReflectError


def refuses(folder, words) -> None:
    """Loading the asset ends with a sentence that has these words and names the folder, and with a remedy."""
    with pytest.raises(ReflectError) as error:
        load_asset(folder)
    assert words in error.value.message and str(folder) in error.value.message
    assert "bake" in error.value.remedy.lower()
