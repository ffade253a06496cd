## An opened export: its scene, a Node3D like any other that may be moved, turned and scaled as a whole, and the method that its reflectors show.
##
##     var check := ReflectCheck.new()                                    # preload("res://addons/reflect/check.gd")
##     var reflections := Reflections.open("/exports/contact", check)     # preload("res://addons/reflect/reflections.gd")
##     if reflections and reflections.use("depth_maps", check):
##         add_child(reflections.scene.root)
##     else:
##         push_error(check.problem)
extends RefCounted

const Check := preload("check.gd")
const Files := preload("files.gd")
const GltfScene := preload("gltf_scene.gd")
const Images := preload("images.gd")
const Manifest := preload("manifest.gd")
const Shaders := preload("shaders.gd")

var manifest: Dictionary
var scene: GltfScene
var shown := ""  # the method that is seen; empty: Godot's own mirrors
var rays := 1  # most rays of a pixel where a curved mirror stretches it, odd; 7 are those of `reflect render`
var _files: Files
var _mirrors: Array[Array] = []  # of each reflector
var _textures := {}  # by checksum
var _earlier := {}  # those of what was shown before, while another is made
var _shaders := {}  # by text
var _behind: ImageTexture
var _backdrop: MeshInstance3D


## Reads manifest and scene of a folder; null where check.problem says why.
static func open(folder: String, check: Check) -> RefCounted:
	check.problem = ""
	var made := new()
	made._files = Files.new(folder, check)
	var bytes := made._files.content(Manifest.FILE, Manifest.BYTES, false)
	if check.problem:
		return null
	made.manifest = Manifest.parse(bytes.get_string_from_utf8(), check)
	if check.problem:
		return null
	made.scene = GltfScene.read(made._files, made.manifest.scene)
	for k in made.manifest.reflectors.size() if made.scene else 0:
		made._mirrors.append(made.scene.mirrors_of(k, made.manifest, check))
	if check.problem and made.scene:
		made.scene.root.free()
	return made if check.problem.is_empty() else null


## The names of all methods that any reflector has.
func methods() -> Array[String]:
	var found: Array[String] = []
	for reflector: Dictionary in manifest.reflectors:
		for name: String in reflector.methods:
			if not name in found:
				found.append(name)
	return found


## Shows a method, "": Godot's own mirrors. What is seen stays where check.problem says why it cannot. Textures that are not shown any longer are let go.
func use(method: String, check: Check) -> bool:
	check.problem = ""
	if not check.need(method.is_empty() or method in methods(), "reflectors", "have no method %s, only %s" % [method, ", ".join(methods())]):
		return false
	var made: Array[Array] = []
	_files.check = check
	_earlier = _textures
	_textures = {}
	for k in _mirrors.size():
		var answer: Variant = manifest.reflectors[k].methods.get(method)
		for mirror: GltfScene.Mirror in _mirrors[k]:
			made.append([mirror, _material(mirror, answer) if answer else null])
			if check.problem:
				_textures = _earlier
				return false
	for pair in made:
		pair[0].mesh.set_surface_override_material(pair[0].surface, pair[1])
	_earlier = {}
	shown = method
	if _behind:
		_hide_others()
	return true


## Cycles' frame without its mirror part in place of Godot's own shading, for holding against Blender from a picture's camera; null: Godot's again.
func show_behind(picture: Variant, check: Check) -> bool:
	check.problem = ""
	_files.check = check
	var texture: ImageTexture = null
	if picture:
		var most := mini(8 * int(picture.width) * int(picture.height) + (1 << 20), Manifest.IMAGES_BYTES)
		var bytes := _files.content(picture.behind, most, false)
		texture = Images.behind(bytes, int(picture.width), int(picture.height), check) if check.problem.is_empty() else null
		if texture == null:
			return false
	_behind = texture
	for mesh in scene.meshes():
		for surface in mesh.get_surface_override_material_count():
			mesh.set_surface_override_material(surface, null)
	if _backdrop:
		_backdrop.free()
		_backdrop = null
	if _behind:
		_backdrop = MeshInstance3D.new()
		_backdrop.name = "Behind"
		_backdrop.mesh = QuadMesh.new()
		_backdrop.mesh.size = Vector2(2, 2)
		_backdrop.extra_cull_margin = 16384  # it is seen from wherever one looks
		_backdrop.material_override = _with_look(Shaders.behind(true))
		scene.root.add_child(_backdrop)
	return use(shown, check)


## Megabytes on the graphics card of what is shown.
func megabytes() -> float:
	var found := 0
	for texture: ImageTexture in _textures.values():
		found += texture.get_image().get_data_size()
	return found / 1e6


func _material(mirror: GltfScene.Mirror, answer: Dictionary) -> ShaderMaterial:
	var kernel := _files.kernel(manifest.shaders[answer.shader])
	var surface := _files.kernel(manifest.shaders[manifest.surface]) if _files.check.problem.is_empty() else ""
	if _files.check.problem:
		return null
	var plain := mirror.plain as BaseMaterial3D
	var both := plain == null or plain.cull_mode == BaseMaterial3D.CULL_DISABLED
	var made := _with_look(Shaders.mirroring(kernel, surface, answer.samplers.keys(), answer.slots.size(), rays, _behind != null, both))
	for name: String in answer.samplers:
		made.set_shader_parameter(name, _texture(manifest.images[answer.samplers[name]]))
	var slots := PackedVector4Array()
	for slot: Array in answer.slots:
		slots.append(Vector4(slot[0], slot[1], slot[2], slot[3]))
	var own := mirror.material
	made.set_shader_parameter("answer_uniforms", slots)
	made.set_shader_parameter("reflect_from_mesh", Projection(mirror.blender_from_mesh))
	made.set_shader_parameter("reflect_normal", mirror.blender_from_mesh.basis.inverse().transposed())
	made.set_shader_parameter("reflect_base_color", Vector3(own.base_color[0], own.base_color[1], own.base_color[2]))
	made.set_shader_parameter("reflect_specular_tint", Vector3(own.specular_tint[0], own.specular_tint[1], own.specular_tint[2]))
	made.set_shader_parameter("reflect_numbers", Vector4(own.metallic, own.ior, own.weight, own.roughness))
	if plain and not _behind:
		made.set_shader_parameter("reflect_albedo", plain.albedo_color)
		made.set_shader_parameter("reflect_albedo_map", plain.albedo_texture)
	return made


## A material of this text that knows the look and, where there is one, the picture behind.
func _with_look(code: String) -> ShaderMaterial:
	if not _shaders.has(code):
		_shaders[code] = Shader.new()
		_shaders[code].code = code
	var made := ShaderMaterial.new()
	made.shader = _shaders[code]
	made.set_shader_parameter("reflect_gain", pow(2.0, manifest.look.exposure))
	made.set_shader_parameter("reflect_has_look", manifest.look.table != null)
	if manifest.look.table != null:
		made.set_shader_parameter("reflect_look", _texture(manifest.images[manifest.look.table]))
	if _behind:
		made.set_shader_parameter("reflect_behind", _behind)
	return made


## Read once, whoever uses it.
func _texture(entry: Dictionary) -> ImageTexture:
	if not _textures.has(entry.sha256):
		var kept: ImageTexture = _earlier.get(entry.sha256)
		if kept == null and _files.check.problem.is_empty():
			var bytes := _files.promised(entry)
			kept = Images.texture_of(bytes, entry, _files.check) if _files.check.problem.is_empty() else null
		if kept == null:
			return null
		_textures[entry.sha256] = kept
	return _textures[entry.sha256]


## Other things only stand before what is behind them.
func _hide_others() -> void:
	var hidden := _with_look(Shaders.behind(false))
	for mesh in scene.meshes():
		for surface in mesh.get_surface_override_material_count() if mesh != _backdrop else 0:
			if mesh.get_surface_override_material(surface) == null:
				mesh.set_surface_override_material(surface, hidden)
