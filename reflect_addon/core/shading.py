"""What a surface makes of the radiance that a mirror ray brings: reflectance, tint, attenuation. Written once as
kernel functions: recorded, they run in NumPy and are emitted as GLSL for the resolve pass.

Reflectance follows Cycles' Principled node (measured against it in tests/core/test_shading.py):
- metal: the F82-tint model of Kutz, Hasan, Edmondson 2021 ("Novel aspects of the Adobe Standard Material"): Schlick's
  curve from the base colour, pulled so that at cos = 1/7 it is the Schlick value times the tint;
- dielectric: the exact Fresnel equations for the index of refraction, their range [F0, 1] mapped to [F0 tint, 1].
Roughness changes the shape of the reflection, not the reflectance: the energy that a rough lobe loses or regains from
several bounces (a few percent below roughness 0.5) is left out, as are coat, sheen and thin film.
"""

from .snapshot import Material

# Texels of a material in the material table (RGBA32F, one row a material): see material_rows.
MATERIAL_TEXELS = 3
_CORNER = 1.0 / 7.0  # the cosine at which the F82 model is pinned: 82 degrees

# Half of the directions that a GGX surface reflects lie within 2 alpha (radians, small alpha) of the mirror direction:
# slopes r have the cumulative share r^2 / (r^2 + alpha^2), and a normal tilted by r turns the ray by 2 r. A footprint
# spans both sides, hence 4 alpha per metre. alpha is Blender's roughness squared.
ROUGHNESS_SPREAD = 4.0


def roughness_spread(material: Material) -> float:
    """Growth per metre of the footprint of a ray that the material's lobe widens."""
    return ROUGHNESS_SPREAD * material.roughness**2


def material_rows(material: Material) -> list[list[float]]:
    """MATERIAL_TEXELS rows of 4 floats: base colour + metallic, specular tint + ior,
    weight + roughness_spread + 2 spare."""
    return [
        [*material.base_color, material.metallic],
        [*material.specular_tint, material.ior],
        [material.specular_weight, roughness_spread(material), 0.0, 0.0],
    ]


def fresnel_dielectric(k, cosine, ior):
    """Unpolarised reflectance of a smooth boundary (Fresnel's equations); ior: inside over outside, > 0."""
    k.cite("Fresnel's equations, c = cosine, g^2 = ior^2 - 1 + c^2; no g: total reflection")
    g2 = ior * ior - 1.0 + cosine * cosine
    g = k.sqrt(g2)
    a = (g - cosine) / k.max(g + cosine, 1e-6)
    b = (cosine * (g + cosine) - 1.0) / k.away_from_zero(cosine * (g - cosine) + 1.0, 1e-6)
    return k.select(g2 < 0.0, 1.0, k.min(0.5 * a * a * (1.0 + b * b), 1.0))


def fresnel_metal(k, cosine, base_color, tint):
    """vec3: F82-tint reflectance of a metal."""
    k.cite("F82-tint: Schlick minus a term that is zero at 0 and 90 degrees and pins cos = 1/7 to tint times Schlick")
    grazing = 1.0 - cosine
    fifth = grazing * grazing * grazing * grazing * grazing
    schlick = base_color + (1.0 - base_color) * fifth
    pinned = base_color + (1.0 - base_color) * (1.0 - _CORNER) ** 5
    pull = pinned * (1.0 - tint) * (1.0 / (_CORNER * (1.0 - _CORNER) ** 6))
    return k.clamp(schlick - pull * (cosine * fifth * grazing), 0.0, 1.0)


def reflectance(k, scope, cosine, base_color, metallic, specular_tint, ior, weight):
    """{'reflectance': vec3, 'opacity': float}: share of the mirror ray's radiance that leaves towards the viewer, and
    share of the surface's own (diffuse) light that the reflection replaces: all of it for a metal.

    options: has_metal, has_dielectric: a term that no material of the scene needs is not emitted.
    """
    cosine = k.clamp(cosine, 0.0, 1.0)
    metal = fresnel_metal(k, cosine, base_color, specular_tint) if scope.options["has_metal"] else None
    glossy = None
    if scope.options["has_dielectric"]:
        fresnel = fresnel_dielectric(k, cosine, ior)
        ratio = (ior - 1.0) / (ior + 1.0)
        lowest = ratio * ratio
        share = k.clamp((fresnel - lowest) / k.max(1.0 - lowest, 1e-6), 0.0, 1.0)
        tinted = k.min(lowest * specular_tint, 1.0)
        glossy = tinted + (1.0 - tinted) * share
    if metal is None:
        colour, opacity = glossy, k.max(glossy.x, glossy.y, glossy.z)
    elif glossy is None:
        colour, opacity = metal, 1.0
    else:
        colour = k.mix(glossy, metal, metallic)
        opacity = k.mix(k.max(glossy.x, glossy.y, glossy.z), 1.0, metallic)
    return {"reflectance": colour * weight, "opacity": opacity * weight}


def leveled_ior(k, scope, ior, level):
    """{'ior': float}: the index whose reflectance straight on is that of ior times twice the specular level (Principled BSDF)."""
    root = k.min(k.sqrt(k.max(2.0 * level, 0.0)) * k.abs((ior - 1.0) / k.max(ior + 1.0, 1e-6)), 0.999)
    return {"ior": (1.0 + root) / (1.0 - root)}


LEVELED_INPUTS = {"ior": "float", "level": "float"}

REFLECTANCE_INPUTS = {
    "cosine": "float",
    "base_color": "vec3",
    "metallic": "float",
    "specular_tint": "vec3",
    "ior": "float",
    "weight": "float",
}


def attenuation(k, scope, distance, half_distance):
    """{'attenuation': float}: reflections fade with the distance of what is reflected (popescu-2006, Figs 2 and 15; the
    paper gives no formula): halved for each half_distance metres. An effect for the eye; off by default."""
    return {"attenuation": k.exp2(-k.max(distance, 0.0) / k.max(half_distance, 1e-20))}


ATTENUATION_INPUTS = {"distance": "float", "half_distance": "float"}
