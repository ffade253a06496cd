"""A shader node that mirrors, as EEVEE is to draw it: without its mirror-like lobes, and the reflection group's light in their place.

Problem. The group answers what the mirror ray brings. How much of it leaves, and what lies below, is the artist's node's affair.
Idea. What is below is the node again with those lobes switched off, or what remains of it (a glass's refraction); it loses the share that the lobe takes
(`opacity`), and the lobe's light, radiance times reflectance, comes as emission. Reflectances are the overlay's (core/shading.py).
Where the method does not answer a ray (coverage below 1) the artist's own node shows, as in the overlay, where the viewport's shading does.
Limits. A lobe keeps or loses its place by its roughness when the materials are made, a texture's by its mean. Left out: anisotropy, thin film, the
tint of a coat, a rough coat on a mirror, sheen above a pure metal. Glass goes through one surface, as EEVEE's does.
"""

from .kernel_group import ior_group
from .materials import leaf_lobes
from .native_sheet import Sheet, covers_everything
from .reflection_group import reflectance_group

WHITE = (1.0, 1.0, 1.0)


def stand_in(sheet: Sheet, node, roughest: float):
    """The output of what EEVEE draws in a node's place; None where nothing of it mirrors sharply enough."""
    make = MAKERS.get(node.bl_idname)
    if make is None or not any(lobe.roughness <= roughest and lobe.reflectance() > 0 for lobe in leaf_lobes(node, sheet.path)):
        return None
    made = make(sheet, node, roughest)
    if made is None:
        return None
    answer, shader = made
    if covers_everything(sheet.group):
        return shader
    return _mix(sheet, answer.outputs["Coverage"], node.outputs[0], shader)


def _principled(sheet: Sheet, node, roughest: float):
    given = node.inputs
    bare = {"Alpha": 1.0}
    coat = sheet.constant(given["Coat Weight"]) != 0.0
    if coat:
        bare["Coat_Weight"] = 0.0
    answer = base = None
    if sharp := sheet.value(given["Roughness"]) <= roughest:
        bare |= {"Metallic": 0.0, "Specular_IOR_Level": 0.0, "Transmission_Weight": 0.0, "Emission_Strength": 0.0}
        answer = sheet.answer(given["Normal"], given["Roughness"])
        share = _share(sheet, answer, given["Base Color"], given["Metallic"], given["Specular Tint"], _ior(sheet, node))
        if sheet.constant(given["Metallic"]) != 1.0:
            base = _mix(sheet, share.outputs["Opacity"], _below(sheet, node, bare), None)
        base = _add(sheet, base, _light(sheet, answer, share.outputs["Reflectance"]))
        if sheet.constant(given["Emission Strength"]) != 0.0:
            base = _add(sheet, base, sheet.op("ShaderNodeEmission", given["Emission Color"], given["Emission Strength"]).outputs[0])
    if coat and sheet.value(given["Coat Roughness"]) <= roughest:
        answer = sheet.answer(given["Coat Normal"], given["Coat Roughness"])
        share = _share(sheet, answer, WHITE, 0.0, WHITE, given["Coat IOR"], given["Coat Weight"])
        base = base or sheet.clone(node, **bare).outputs[0]
        base = _add(sheet, _mix(sheet, share.outputs["Opacity"], base, None), _light(sheet, answer, share.outputs["Reflectance"]))
    elif not sharp:
        return None
    if sheet.constant(given["Alpha"]) != 1.0:
        base = _mix(sheet, given["Alpha"], sheet.op("ShaderNodeBsdfTransparent", WHITE).outputs[0], base)
    return answer, base


def _below(sheet: Sheet, node, bare: dict):
    """What is under a Principled node's mirror lobe: the rest of it, and what goes through. (Its transmission keeps a mirror lobe
    whatever its specular level says.)"""
    given, rest = node.inputs, None
    through = sheet.constant(given["Transmission Weight"])
    if through != 1.0:
        rest = sheet.clone(node, **bare).outputs[0]
    if through == 0.0:
        return rest
    color = sheet.op("ShaderNodeGamma", given["Base Color"], 0.5).outputs[0]  # its base colour is that of two crossings
    if sheet.constant(given["Thin Wall"]):
        clear = sheet.op("ShaderNodeBsdfTransparent", given["Base Color"])
    else:
        clear = sheet.op("ShaderNodeBsdfRefraction", color, given["Roughness"], given["IOR"], given["Normal"])
    return clear.outputs[0] if rest is None else _mix(sheet, given["Transmission Weight"], rest, clear.outputs[0])


def _ior(sheet: Sheet, node):
    """Source of the index whose reflectance straight on is the Principled node's."""
    given = node.inputs
    if sheet.constant(given["Specular IOR Level"]) == 0.5 or sheet.constant(given["Transmission Weight"]) == 1.0:
        return given["IOR"]
    return sheet.op("ShaderNodeGroup", given["IOR"], given["Specular IOR Level"], node_tree=ior_group()).outputs[0]


def _glossy(sheet: Sheet, node, _roughest: float):
    answer = sheet.answer(node.inputs["Normal"], node.inputs["Roughness"])
    return answer, _light(sheet, answer, node.inputs["Color"])


def _metallic(sheet: Sheet, node, _roughest: float):
    answer = sheet.answer(node.inputs["Normal"], node.inputs["Roughness"])
    base, edge = node.inputs["Base Color"], node.inputs["Edge Tint"]
    if node.fresnel_type != "F82":
        lobe = leaf_lobes(node, sheet.path)[0]
        base, edge = lobe.base_color, lobe.specular_tint
    return answer, _light(sheet, answer, _share(sheet, answer, base, 1.0, edge, 1.5).outputs["Reflectance"])


def _glass(sheet: Sheet, node, _roughest: float):
    given = node.inputs
    answer = sheet.answer(given["Normal"], given["Roughness"])
    share = _share(sheet, answer, WHITE, 0.0, WHITE, given["IOR"])
    through = sheet.op("ShaderNodeBsdfRefraction", given["Color"], given["Roughness"], given["IOR"], given["Normal"])
    tinted = sheet.op("ShaderNodeVectorMath", share.outputs["Reflectance"], given["Color"], operation="MULTIPLY").outputs[0]
    return answer, _add(sheet, _mix(sheet, share.outputs["Opacity"], through.outputs[0], None), _light(sheet, answer, tinted))


def _eevee_specular(sheet: Sheet, node, _roughest: float):
    given = node.inputs
    answer = sheet.answer(given["Normal"], given["Roughness"])
    share = _share(sheet, answer, given["Specular"], 1.0, WHITE, 1.5)
    light = _mix(sheet, given["Transparency"], _light(sheet, answer, share.outputs["Reflectance"]), None)
    return answer, _add(sheet, sheet.clone(node, Specular=(0.0, 0.0, 0.0)).outputs[0], light)


MAKERS = {
    "ShaderNodeBsdfPrincipled": _principled,
    "ShaderNodeBsdfAnisotropic": _glossy,
    "ShaderNodeBsdfGlossy": _glossy,
    "ShaderNodeBsdfMetallic": _metallic,
    "ShaderNodeBsdfGlass": _glass,
    "ShaderNodeEeveeSpecular": _eevee_specular,
}


def _share(sheet: Sheet, answer, color, metallic, tint, ior, weight=1.0):
    """The overlay's reflectance for an answer's mirror ray: outputs Reflectance and Opacity."""
    return sheet.op("ShaderNodeGroup", answer.outputs["Cosine"], color, metallic, tint, ior, weight, node_tree=reflectance_group())


def _light(sheet: Sheet, answer, reflectance):
    light = sheet.op("ShaderNodeVectorMath", answer.outputs["Radiance"], reflectance, operation="MULTIPLY")
    return sheet.op("ShaderNodeEmission", light.outputs[0]).outputs[0]


def _mix(sheet: Sheet, factor, first, second):
    return sheet.op("ShaderNodeMixShader", factor, first, second).outputs[0]


def _add(sheet: Sheet, first, second):
    return second if first is None else sheet.op("ShaderNodeAddShader", first, second).outputs[0]
