"""The resolve pass without Fresnel: what the cost of Fresnel is measured against (popescu-2006, Fig. 2)."""

from ..gpu.resolve import Resolve


class PlainResolve(Resolve):
    """Every surface reflects its base colour's share, seen from anywhere."""

    def _reflectance(self) -> tuple[str, str]:
        return "", "  vec3 reflectance = base.rgb * weight;\n  float opacity = weight;\n"
