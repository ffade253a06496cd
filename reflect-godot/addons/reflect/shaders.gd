## The shaders of an export: its kernels, what surrounds them, and the looks that a picture from Blender's camera needs.
extends RefCounted

const MIRROR := preload("mirror.gdshaderinc")
const LOOK := preload("look.gdshaderinc")

## In the fragment function of what mirrors.
const SURFACE := """
  float reflect_pixel = 2.0 / (abs(PROJECTION_MATRIX[1][1]) * VIEWPORT_SIZE.y);
  vec3 added;
  float opacity;
  reflect_surface(reflect_place, reflect_shading, reflect_eye, reflect_ahead, reflect_pixel, PROJECTION_MATRIX[3][3] == 1.0, added, opacity);
"""
## Lit by Godot: what the surface is beside a mirror is the glTF material's, and reflections come on top.
const LIT := """
uniform vec4 reflect_albedo : source_color = vec4(1.0);
uniform sampler2D reflect_albedo_map : source_color, hint_default_white, filter_linear_mipmap, repeat_enable;
void fragment()
{%s
  ALBEDO = reflect_albedo.rgb * texture(reflect_albedo_map, UV).rgb * (1.0 - reflect_numbers.x) * (1.0 - opacity);
  METALLIC = 0.0;
  SPECULAR = 0.0;
  ROUGHNESS = 1.0;
  EMISSION = reflect_for_display(added);
}
"""
## Over a picture of the scene without its mirrors.
const OVER := """
uniform sampler2D reflect_behind : filter_linear, repeat_disable;
void fragment()
{%s
  ALBEDO = reflect_for_display(textureLod(reflect_behind, SCREEN_UV, 0.0).rgb + added);
}
"""
## That picture itself, where nothing mirrors: on other things, and behind all.
const BEHIND := """
uniform sampler2D reflect_behind : filter_linear, repeat_disable;
void fragment()
{
  ALBEDO = reflect_for_display(textureLod(reflect_behind, SCREEN_UV, 0.0).rgb);
}
"""
const EVERYWHERE := """
void vertex()
{
  POSITION = vec4(VERTEX.xy, CLIP_SPACE_FAR, 1.0);
}
"""


## What mirrors. kernel, surface: texts of the export; slots: length of the kernel's uniform array; rays: most rays of a pixel, odd; over: over a picture; sides: both are seen.
static func mirroring(kernel: String, surface: String, samplers: Array, slots: int, rays: int, over: bool, sides: bool) -> String:
	var modes := (["unshaded"] if over else []) + ["cull_disabled" if sides else "cull_back"]
	var lines := ["shader_type spatial;", "render_mode %s;" % ", ".join(modes), "#define REFLECT_RAYS %d" % rays]
	for name: String in samplers:
		lines.append("uniform sampler2D %s : filter_nearest, repeat_disable;" % name)
	if slots:
		lines.append("uniform vec4 answer_uniforms[%d];" % slots)
	return "\n".join(lines + [kernel, surface, LOOK.code, MIRROR.code, (OVER if over else LIT) % SURFACE])


## The picture behind, on other things or, `everywhere`, on a quad that fills the screen.
static func behind(everywhere: bool) -> String:
	return "shader_type spatial;\nrender_mode unshaded, cull_disabled, shadows_disabled;\n" + LOOK.code + BEHIND + (EVERYWHERE if everywhere else "")
