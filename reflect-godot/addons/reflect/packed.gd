## An export as a scene of Godot's own: one file with meshes, textures and shaders, that needs neither the export nor this add-on any longer.
extends RefCounted

const Check := preload("check.gd")
const Reflections := preload("reflections.gd")


## Saves what an export shows by a method as `path` (.scn); false where check.problem says why.
static func save(folder: String, method: String, path: String, check: Check) -> bool:
	var reflections: Reflections = Reflections.open(folder, check)
	if reflections == null:
		return false
	var root: Node3D = reflections.scene.root
	var scene := PackedScene.new()
	if reflections.use(method, check):
		check.file = path
		check.need(scene.pack(root) == OK and ResourceSaver.save(scene, path, ResourceSaver.FLAG_COMPRESS) == OK, "", "cannot be written")
	root.free()
	return check.problem.is_empty()
