## The scene of an export through Godot's own glTF reader, held to the export's folder; which of its surfaces mirror, and its cameras.
extends RefCounted

const Check := preload("check.gd")
const Files := preload("files.gd")

const BUFFER_BYTES := 1 << 30
const PICTURE_BYTES := 256 << 20
const VALUES := 1 << 27  # of an accessor
const EMPTY_VALUES := 1 << 20  # of one that no buffer fills
const UNCOMPRESSED := 64  # EditorSceneFormatImporter.IMPORT_FORCE_DISABLE_MESH_COMPRESSION, which games have not: else places are rounded to 16 bits
## Blender's world from glTF's: y up to z up.
const BLENDER_FROM_GLTF := Transform3D(Vector3(1, 0, 0), Vector3(0, 0, 1), Vector3(0, -1, 0), Vector3.ZERO)

var root: Node3D
var document: Dictionary
var _state := GLTFState.new()


## A surface of a mesh that mirrors.
class Mirror:
	var mesh: MeshInstance3D
	var surface: int
	var material: Dictionary  # of the manifest
	var plain: Material  # as glTF has it
	var blender_from_mesh: Transform3D


## Reads the scene; null where check.problem says why.
static func read(files: Files, scene: Dictionary) -> RefCounted:
	var check := files.check
	var bytes := files.promised(scene)
	var reader := JSON.new()
	if check.problem or not check.need(reader.parse(bytes.get_string_from_utf8()) == OK and reader.data is Dictionary, "", "is not glTF"):
		return null
	var made := new()
	made.document = reader.data
	if not made._is_plain(files) or not check.need(made._open(bytes, files.folder), "", "cannot be read as glTF"):
		return null
	return made


## The surfaces of a reflector's node that have its materials.
func mirrors_of(index: int, manifest: Dictionary, check: Check) -> Array[Mirror]:
	check.file = "reflect.json"
	var found: Array[Mirror] = []
	var reflector: Dictionary = manifest.reflectors[index]
	var field := "reflectors[%d].node" % index
	var node := _node(int(reflector.node), field, check)
	if node == null:
		return found
	var own: Variant = document.nodes[int(reflector.node)].get("extensions", {}).get("REFLECT_reflections", {}).get("reflector")
	if not check.need(own is float and own == index, field, "is a node that does not name this reflector back"):
		return found
	var wanted := {}
	for k: float in reflector.materials:
		wanted[manifest.materials[int(k)].name] = manifest.materials[int(k)]
	var mesh := node as MeshInstance3D
	var primitives: Array = document.meshes[int(document.nodes[int(reflector.node)].mesh)].primitives if mesh and mesh.mesh else []
	if not check.need(mesh == null or primitives.size() == mesh.mesh.get_surface_count(), field, "has a mesh with other surfaces than its glTF says"):
		return found
	for surface in primitives.size():
		var name: Variant = document.materials[int(primitives[surface].material)].get("name", "") if primitives[surface].has("material") else ""
		if wanted.has(name):
			var one := Mirror.new()
			one.mesh = mesh
			one.surface = surface
			one.material = wanted[name]
			one.plain = mesh.mesh.surface_get_material(surface)
			one.blender_from_mesh = BLENDER_FROM_GLTF * _in_scene(mesh)
			found.append(one)
	return found


## A camera that stands where glTF says and sees what the picture's projection says; null where there is none. It is not in the tree.
func camera_of(picture: Dictionary, check: Check) -> Camera3D:
	check.file = "reflect.json"
	var node := _node(int(picture.node), "pictures.node", check)
	if node == null:
		return null
	var seen: Array = node.find_children("*", "Camera3D", true, false)
	var own: Camera3D = node if node is Camera3D else seen[0] if seen else null
	if not check.need(own != null, "pictures.node", "is no camera"):
		return null
	var p: Array = picture.projection
	if not check.need(p[0] > 0 and p[5] > 0 and (p[15] == 1 or p[11] == -1), "pictures.projection", "is none of a camera"):
		return null
	var camera := Camera3D.new()
	camera.transform = _in_scene(own).orthonormalized()
	camera.keep_aspect = Camera3D.KEEP_HEIGHT
	if p[15] == 1:
		camera.set_orthogonal(2.0 / p[5], own.near, own.far)
		camera.h_offset = -p[12] / p[0]
		camera.v_offset = -p[13] / p[5]
	else:
		camera.set_frustum(2.0 * own.near / p[5], own.near * Vector2(p[8] / p[0], p[9] / p[5]), own.near, own.far)
	return camera


func meshes() -> Array[MeshInstance3D]:
	var found: Array[MeshInstance3D] = []
	found.assign(root.find_children("*", "MeshInstance3D", true, false))
	return found


func _node(index: int, field: String, check: Check) -> Node3D:
	var entries: Variant = document.get("nodes")
	var there: bool = entries is Array and index < entries.size() and entries[index] is Dictionary
	if not check.need(there, field, "is %d, and the scene has no such node" % index):
		return null
	# Godot gives nodes names of their own, and replaces meshes' by others of the same name.
	var name: String = _state.get_nodes()[index].resource_name
	var found := root if root.name == name else root.find_child(name, true, false)
	check.need(found is Node3D, field, "is a node that Godot did not make")
	return found as Node3D


func _in_scene(node: Node3D) -> Transform3D:
	var found := node.transform
	var at := node.get_parent()
	while at != null and at != root:
		found = (at as Node3D).transform * found if at is Node3D else found
		at = at.get_parent()
	return found


func _open(bytes: PackedByteArray, folder: String) -> bool:
	var reader := GLTFDocument.new()
	if reader.append_from_buffer(bytes, folder.path_join(""), _state, UNCOMPRESSED) != OK:
		return false
	root = reader.generate_scene(_state) as Node3D
	return root != null


## Names no file outside the folder, and counts no more than memory has.
func _is_plain(files: Files) -> bool:
	var check := files.check
	check.file = "scene.gltf"
	var name := RegEx.create_from_string("^(textures/)?(?!\\.)[^/\\\\:\\x00-\\x1f]{1,255}$")
	for kind: String in ["buffers", "images"]:
		for one: Variant in check.list(document.get(kind, []), kind):
			var entry := check.table(one, kind)
			if kind == "buffers":
				check.whole(entry.get("byteLength"), "buffers.byteLength", 1, BUFFER_BYTES)
			if entry.has("uri") and check.problem.is_empty():
				var uri := check.text(entry.uri, kind + ".uri", 1 << 30)
				if uri.begins_with("data:"):
					continue
				if check.need(name.search(uri.uri_decode()) != null, kind + ".uri", 'is "%s", which is no plain name in the export' % uri.left(60)):
					files.content(uri.uri_decode(), int(entry.byteLength) if kind == "buffers" else PICTURE_BYTES, false)
					check.file = "scene.gltf" if check.problem.is_empty() else check.file
	for one: Variant in check.list(document.get("accessors", []), "accessors"):
		var accessor := check.table(one, "accessors")
		check.whole(accessor.get("count"), "accessors.count", 1, VALUES if accessor.has("bufferView") else EMPTY_VALUES)
	return check.problem.is_empty()
