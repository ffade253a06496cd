"""What the sidebar's panels show, as text, without a window."""

from types import SimpleNamespace

import bpy
import numpy as np

from reflect_addon.ui import native, overlays, panel, plan


class _Recorder:
    """A layout that writes down what a panel draws."""

    def __init__(self, seen):
        self.seen = seen

    def __getattr__(self, name):
        def call(*arguments, **keywords):
            if name == "prop":
                assert keywords or arguments[0].bl_rna.properties[arguments[1]] is not None
            if name == "operator":
                getattr(bpy.ops.reflect, arguments[0].removeprefix("reflect.")).get_rna_type()
            self.seen.append((name, *arguments, *keywords.values()))
            return SimpleNamespace() if name == "operator" else _Recorder(self.seen)

        return call


class _Layout(_Recorder):
    use_property_split = use_property_decorate = False


def drawn(**space):
    """All text that the panels show."""
    shading = SimpleNamespace(type=space.get("shading", "SOLID"))
    overlay = SimpleNamespace(show_overlays=space.get("overlays", True))
    eye = np.eye(4)
    eye[:3, 3] = space.get("eye", (0, 0, 0))
    lens = np.array([[1.0, 0, 0, 0], [0, 1.0, 0, 0], [0, 0, -1.0, -0.1], [0, 0, -1.0, 0]])
    context = SimpleNamespace(
        scene=bpy.context.scene,
        object=bpy.context.object,
        area=SimpleNamespace(regions=[SimpleNamespace(type="WINDOW", width=64, height=48, as_pointer=lambda: 1)]),
        preferences=SimpleNamespace(system=SimpleNamespace(ui_scale=1.0)),  # 0 without a window
        region=SimpleNamespace(width=3000),
        space_data=SimpleNamespace(
            shading=shading, overlay=overlay, region_3d=SimpleNamespace(view_matrix=np.linalg.inv(eye), window_matrix=lens)
        ),
    )
    seen = []
    for cls in (
        panel.REFLECT_PT_main, panel.REFLECT_PT_found, panel.REFLECT_PT_settings, panel.REFLECT_PT_advanced,
        panel.REFLECT_PT_assets, native.REFLECT_PT_native, overlays.REFLECT_PT_overlays,
        plan.REFLECT_PT_plan,
    ):  # fmt: skip
        if not hasattr(cls, "poll") or cls.poll(context):
            cls.draw(SimpleNamespace(layout=_Layout(seen)), context)
    return " ".join(str(word) for entry in seen for word in entry[1:] if isinstance(word, str))
