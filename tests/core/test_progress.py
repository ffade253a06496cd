"""core/progress.py: what work tells of itself."""

import pytest

from reflect_addon.core.errors import Cancelled
from reflect_addon.core.progress import Stages, teller


def test_it_never_goes_back_and_stops_when_told():
    heard = []
    say = teller(lambda share, text: heard.append((share, text)), "The work")
    for share, text in ((0.1, "a"), (0.5, "b"), (0.2, "c"), (0.7, "d")):
        say(share, text)
    assert heard == [(0.1, "a"), (0.5, "b"), (0.5, "c"), (0.7, "d")]
    teller(None, "The work")(0.5, "nobody listens")
    with pytest.raises(Cancelled, match="The work"):
        teller(lambda share, text: False, "The work")(0.0, "")


def test_stages_say_how_much_time_is_left():
    heard = []
    stages = Stages(lambda share, text: heard.append((share, text)))
    stages.tell(0.5)
    stages.set(0.5, 1.0, "views")
    stages.tell(0.5)
    assert [share for share, _ in heard] == [0.5, 0.5, 0.75] and heard[0][1] == "" and heard[2][1].startswith(": views, about ")
