"""Materials for EEVEE's own pictures: what is wanted is the radiance that it reflects, before Fresnel and tint, along each pixel's mirror ray.

EEVEE's "specular light" pass is that, as long as a surface has one reflecting layer. So materials keep their look, since other reflectors show
them, and lose only what would turn or spread the mirror ray: roughness, anisotropy and normal maps. A material with several reflecting
layers, with refraction or without nodes becomes a white mirror, which `straighten` tells.
"""

import bpy

# Sockets of shader nodes that turn or spread the mirror ray, and their values without it.
STRAIGHT = {"Roughness": 0.0, "Anisotropic": 0.0, "Anisotropy": 0.0, "Normal": None}
ONE_LAYER = {"BSDF_PRINCIPLED", "BSDF_GLOSSY", "BSDF_METALLIC", "EEVEE_SPECULAR"}
REFRACTS = {"BSDF_GLASS", "BSDF_REFRACTION"}


def straighten(materials: tuple[str, ...], marked: tuple[str, ...]) -> list[str]:
    """Makes the shiny materials reflect along the mirror ray only; returns the names of those that became white mirrors."""
    replaced = []
    for material in [m for m in bpy.data.materials if m.name in materials]:
        nodes = list(_nodes(material.node_tree))
        shiny = [n for n in nodes if n.type in ONE_LAYER]
        if len(shiny) == 1 and not any(_refracts(n) or _has_coat(n) for n in nodes):
            _straighten_node(shiny[0])
        else:
            replaced.append(material.name)
            _make_mirror(material)
    mirror = None
    for obj in [bpy.data.objects[name] for name in marked]:
        mirror = mirror or _make_mirror(bpy.data.materials.new("Reflect mirror"))
        if not obj.material_slots:
            obj.data.materials.append(mirror)
        for slot in obj.material_slots:
            slot.link, slot.material = "OBJECT", mirror
        replaced.append(f"all of {obj.name}")
    return replaced


def _nodes(tree, depth: int = 0):
    for node in tree.nodes if tree is not None and depth < 16 else ():
        yield node
        if node.type == "GROUP":
            yield from _nodes(node.node_tree, depth + 1)


def _refracts(node) -> bool:
    return node.type in REFRACTS or node.type == "BSDF_PRINCIPLED" and _is_on(node.inputs["Transmission Weight"])


def _has_coat(node) -> bool:
    return node.type == "BSDF_PRINCIPLED" and _is_on(node.inputs["Coat Weight"])


def _is_on(socket) -> bool:
    return socket.is_linked or socket.default_value > 0


def _straighten_node(node) -> None:
    for name, value in STRAIGHT.items():
        socket = node.inputs.get(name)
        for link in list(socket.links) if socket else ():
            node.id_data.links.remove(link)
        if socket and value is not None:
            socket.default_value = value


def _make_mirror(material):
    tree = material.node_tree
    output = tree.get_output_node("EEVEE") or tree.nodes.new("ShaderNodeOutputMaterial")
    node = tree.nodes.new("ShaderNodeBsdfGlossy")
    node.inputs["Color"].default_value, node.inputs["Roughness"].default_value = (1, 1, 1, 1), 0.0
    tree.links.new(node.outputs[0], output.inputs["Surface"])
    return material
