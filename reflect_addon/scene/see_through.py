"""Whether a material can only ever be met where its mesh is: so what else it is cannot change where rays end."""

from .native_marks import is_for_eevee_alone

# Shaders through which no ray goes on straight; what is not in this list may.
SOLID = {
    "BSDF_PRINCIPLED", "BSDF_DIFFUSE", "BSDF_GLOSSY", "BSDF_METALLIC", "BSDF_GLASS", "BSDF_REFRACTION", "BSDF_SHEEN", "BSDF_TOON", "BSDF_TRANSLUCENT",
    "SUBSURFACE_SCATTERING", "EMISSION",
}  # fmt: skip
JOINS = {"MIX_SHADER", "ADD_SHADER", "REROUTE"}


def is_solid(material) -> bool:
    """False where it may let rays through or move the surface, also where that is not known: a group, a script. No material is solid."""
    if material is None:
        return True
    nodes = [node for node in material.node_tree.nodes if not is_for_eevee_alone(node)] if material.node_tree else []
    outputs = [node for node in nodes if node.bl_idname == "ShaderNodeOutputMaterial"]
    if not outputs or any(not _is_fed(o.inputs["Surface"]) or o.inputs["Displacement"].is_linked for o in outputs):
        return False
    return all(_is_solid(node) for node in nodes if any(s.type == "SHADER" for s in node.outputs))


def _is_fed(socket) -> bool:
    return socket.is_linked and not socket.links[0].is_muted


def _is_solid(node) -> bool:
    if node.type == "BSDF_PRINCIPLED":
        alpha = node.inputs["Alpha"]
        return not node.mute and not alpha.is_linked and alpha.default_value >= 1.0
    return not node.mute and node.type in SOLID | JOINS
