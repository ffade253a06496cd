## The manifest of an export, reflect.json, before anything of it is believed: structure, names, sizes, ids, numbers and how much memory it would take.
## docs/export-format.md of Reflect is the contract.
extends RefCounted

const Check := preload("check.gd")

const FILE := "reflect.json"
const BYTES := 64 << 20
const IMAGES_BYTES := 4 << 30  # all images together
const TEXT_BYTES := 4 << 20
const SCENE_BYTES := 256 << 20
const DEFLATE := 1032  # bytes that it can make of one at most
const SLOTS := 224
const NODE := (1 << 24) - 1
const BITS := {"tx": 64, "buf": 128, "look": 64, "bc1": 4}  # of a texel

## Within format 1 there are these fields and no others.
const FIELDS := ["what", "format", "generator", "scene", "look", "images", "shaders", "bakes", "materials", "surface", "reflectors", "pictures"]
const TEXT := ["file", "bytes", "sha256"]


## What the text of reflect.json says, checked; empty where check.problem says why.
static func parse(json: String, check: Check) -> Dictionary:
	check.file = FILE
	var reader := JSON.new()
	if not check.need(reader.parse(json) == OK, "", "is not JSON"):
		return {}
	var manifest := check.table(reader.data, "the whole")
	check.need(manifest.get("what") is String and manifest.get("what") == "reflect export", "what", 'is not "reflect export"')
	check.whole(manifest.get("format"), "format", 1, 1 << 40)
	if check.problem.is_empty() and manifest.format > 1:
		check.refuse("format", "is %d, and this loader knows 1" % manifest.format)
	if check.record(manifest, "the whole", FIELDS).is_empty() or not _finite(manifest, check):
		return {}
	check.text(manifest.generator, "generator")
	_scene(check.record(manifest.scene, "scene", ["file", "name", "bytes", "sha256"]), check)
	for steps: Callable in [_images, _shaders, _look, _bakes, _materials, _reflectors, _pictures]:
		if check.problem:
			return {}
		steps.call(manifest, check)
	check.entry(manifest.shaders, manifest.surface, "surface")
	return manifest if check.problem.is_empty() else {}


## JSON has no NaN, but 1e999. Godot's reader ends at a depth of its own.
static func _finite(value: Variant, check: Check) -> bool:
	if value is float:
		return check.need(is_finite(value), "a number", "is not finite")
	var items: Array = value.values() if value is Dictionary else value if value is Array else []
	return items.all(func(item: Variant) -> bool: return _finite(item, check))


static func _scene(scene: Dictionary, check: Check) -> void:
	if check.problem.is_empty():
		check.need(scene.file is String and scene.file == "scene.gltf", "scene.file", "is not scene.gltf")
		check.text(scene.name, "scene.name")
		check.whole(scene.bytes, "scene.bytes", 1, SCENE_BYTES)
		check.checksum(scene.sha256, "scene.sha256")


static func _images(manifest: Dictionary, check: Check) -> void:
	var total := 0.0
	for id: String in check.table(manifest.images, "images"):
		var field := "images." + id.left(60)
		var image := check.record(manifest.images[id], field, ["file", "kind", "width", "height", "bytes", "sha256"])
		if check.problem or not check.need(image.kind is String and BITS.has(image.kind), field + ".kind", "is none of " + ", ".join(BITS.keys())):
			return
		check.file_name(image.file, field + ".file", "images", "dds" if image.kind == "bc1" else "exr|ktx2")
		for side: String in ["width", "height"]:
			check.whole(image[side], "%s.%s" % [field, side], 1, Check.SIDE)
		check.whole(image.bytes, field + ".bytes", 1, IMAGES_BYTES)
		if check.problem:
			return
		check.need(image.file.get_file().get_basename() == id, field + ".file", "is not named as its image is")
		check.checksum(image.sha256, field + ".sha256", image.file)
		var texels: float = image.width * image.height * BITS[image.kind] / 8.0
		if image.kind == "bc1":
			check.need(fmod(image.width, 4) == 0 and fmod(image.height, 4) == 0, field, "is no whole number of blocks")
		check.need(texels <= DEFLATE * image.bytes, field + ".bytes", "is too little for a picture of this size")
		check.need(image.bytes <= 2 * texels + (1 << 20), field + ".bytes", "is more than its texels need")
		total += texels
		check.need(total <= IMAGES_BYTES, "images", "are together larger than %d GiB" % (IMAGES_BYTES >> 30))


static func _shaders(manifest: Dictionary, check: Check) -> void:
	for id: String in check.table(manifest.shaders, "shaders"):
		var field := "shaders." + id.left(60)
		var shader := check.record(manifest.shaders[id], field, TEXT + ["godot"])
		if check.problem:
			return
		_text(shader, field, "glsl", check)
		_text(check.record(shader.godot, field + ".godot", TEXT), field + ".godot", "gdshaderinc", check)
		if check.problem.is_empty():
			check.need(shader.file.get_file().get_basename() == id, field + ".file", "is not named as its shader is")


static func _text(entry: Dictionary, field: String, ending: String, check: Check) -> void:
	if check.problem.is_empty():
		var name := check.file_name(entry.file, field + ".file", "shaders", ending)
		check.whole(entry.bytes, field + ".bytes", 1, TEXT_BYTES)
		check.checksum(entry.sha256, field + ".sha256", name)


static func _look(manifest: Dictionary, check: Check) -> void:
	var look := check.record(manifest.look, "look", ["exposure", "table"])
	if check.problem:
		return
	check.number(look.exposure, "look.exposure", -64, 64)
	if look.table != null:
		var image: Variant = check.entry(manifest.images, look.table, "look.table")
		check.need(image != null and image.kind == "look" and image.width == 4096 and image.height == 64, "look.table", "is no look of 4096 x 64 texels")


## What only Reflect reads: that its name is right is all that is asked.
static func _bakes(manifest: Dictionary, check: Check) -> void:
	var bakes := check.record(manifest.bakes, "bakes", TEXT)
	if check.problem:
		return
	check.need(bakes.file is String and bakes.file == "bakes.json", "bakes.file", "is not bakes.json")
	check.whole(bakes.bytes, "bakes.bytes", 1, SCENE_BYTES)
	check.checksum(bakes.sha256, "bakes.sha256")


static func _materials(manifest: Dictionary, check: Check) -> void:
	for material: Variant in check.list(manifest.materials, "materials"):
		var own := check.record(material, "materials", ["name", "base_color", "metallic", "specular_tint", "ior", "weight", "roughness"])
		if check.problem:
			return
		check.text(own.name, "materials.name")
		for colour: String in ["base_color", "specular_tint"]:
			check.numbers(own[colour], "materials." + colour, 3)
		for value: String in ["metallic", "weight", "roughness"]:
			check.number(own[value], "materials." + value)
		check.number(own.ior, "materials.ior", 1e-6)


static func _reflectors(manifest: Dictionary, check: Check) -> void:
	for k in check.list(manifest.reflectors, "reflectors").size():
		var field := "reflectors[%d]" % k
		var reflector := check.record(manifest.reflectors[k], field, ["name", "node", "materials", "methods"])
		if check.problem:
			return
		check.text(reflector.name, field + ".name")
		check.whole(reflector.node, field + ".node", 0, NODE)
		for index: Variant in check.list(reflector.materials, field + ".materials"):
			check.whole(index, field + ".materials", 0, manifest.materials.size() - 1)
		for method: String in check.table(reflector.methods, field + ".methods"):
			check.word(method, field + ".methods")
			_answer(reflector.methods[method], "%s.methods.%s" % [field, method.left(60)], manifest, check)


static func _answer(value: Variant, field: String, manifest: Dictionary, check: Check) -> void:
	var answer := check.record(value, field, ["kind", "assets", "shader", "samplers", "slots", "bytes"])
	if check.problem:
		return
	check.word(answer.kind, field + ".kind")
	check.need(not check.list(answer.assets, field + ".assets").is_empty(), field + ".assets", "are none")
	for id: Variant in check.list(answer.assets, field + ".assets"):
		check.text(id, field + ".assets", 100)
	check.entry(manifest.shaders, answer.shader, field + ".shader")
	for name: String in check.table(answer.samplers, field + ".samplers"):
		# It becomes a word of a shader, so it must be one.
		check.need(check.word(name, field + ".samplers") == name and not "__" in name, field + ".samplers", "has a name that no sampler may have")
		check.entry(manifest.images, answer.samplers[name], "%s.samplers.%s" % [field, name.left(60)])
	check.need(check.list(answer.slots, field + ".slots").size() <= SLOTS, field + ".slots", "are more than %d" % SLOTS)
	for slot: Variant in check.list(answer.slots, field + ".slots"):
		check.numbers(slot, field + ".slots", 4)
	check.whole(answer.bytes, field + ".bytes", 1, 16 * IMAGES_BYTES)


static func _pictures(manifest: Dictionary, check: Check) -> void:
	for value: Variant in check.list(manifest.pictures, "pictures"):
		var picture := check.record(value, "pictures", ["camera", "node", "width", "height", "projection", "behind", "truth", "methods"])
		if check.problem:
			return
		check.text(picture.camera, "pictures.camera")
		check.whole(picture.node, "pictures.node", 0, NODE)
		for side: String in ["width", "height"]:
			check.whole(picture[side], "pictures." + side, 1, Check.SIDE)
		check.numbers(picture.projection, "pictures.projection", 16)
		check.file_name(picture.behind, "pictures.behind", "pictures", "exr")
		check.file_name(picture.truth, "pictures.truth", "pictures", "png")
		for method: String in check.table(picture.methods, "pictures.methods"):
			check.word(method, "pictures.methods")
			check.file_name(picture.methods[method], "pictures.methods", "pictures", "png")
