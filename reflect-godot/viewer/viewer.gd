## Opens an export: godot --path reflect-godot [-- --export FOLDER [--method NAME] [--rays N] [--out FOLDER]]. With --out it draws the export's picture by every
## method (or those of --method, separated by commas), writes FOLDER/<method>.png and drawn.json, and ends (shots.gd).
extends Node3D

const Check := preload("res://addons/reflect/check.gd")
const Reflections := preload("res://addons/reflect/reflections.gd")
const Orbit := preload("res://viewer/orbit.gd")
const Controls := preload("res://viewer/panel.gd")
const Shots := preload("res://viewer/shots.gd")

var check := Check.new()
var reflections: Reflections
var orbit := Orbit.new()
var compared: Camera3D  # Blender's, with Cycles' frame behind; null while one looks around
var panel := Controls.new()
var world := WorldEnvironment.new()
var sun := DirectionalLight3D.new()


func _ready() -> void:
	add_child(orbit)
	add_child(panel)
	_add_light()
	add_child(world)
	add_child(sun)
	panel.folder_chosen.connect(open)
	panel.method_chosen.connect(show_method)
	panel.compare_toggled.connect(compare)
	var wishes := _wishes()
	if wishes.has("out"):
		panel.hide()
		await Shots.draw(self, wishes)
	elif wishes.has("export") and open(wishes.export) and wishes.has("method"):
		show_method(wishes.method)


## Shows an export by its first method; what is wrong with it is said in the panel. `rays`: most of a pixel.
func open(folder: String, rays := 1) -> bool:
	compare(false)
	var found: Reflections = Reflections.open(folder, check)
	if found == null:
		panel.say(check.problem)
		return false
	if reflections:
		reflections.scene.root.free()
	reflections = found
	reflections.rays = rays
	add_child(reflections.scene.root)
	sun.visible = reflections.scene.root.find_children("*", "Light3D", true, false).is_empty()
	for camera: Camera3D in reflections.scene.root.find_children("*", "Camera3D", true, false):
		camera.current = false
	var pictures: Array = reflections.manifest.pictures
	var from: Camera3D = reflections.scene.camera_of(pictures[0], check) if pictures else null
	orbit.show_all(_box(), from)
	if from:
		from.free()
	orbit.make_current()
	panel.fill(reflections, not pictures.is_empty())
	return show_method(reflections.methods()[0])


func show_method(method: String) -> bool:
	var start := Time.get_ticks_msec()
	var done: bool = reflections != null and reflections.use(method, check)
	panel.say("%s: %.1f MB, %d ms" % [method, reflections.megabytes(), Time.get_ticks_msec() - start] if done else check.problem)
	return done


## From the first picture's camera with Cycles' frame behind, or around again.
func compare(wanted: bool) -> bool:
	if reflections == null or wanted == (compared != null):
		return reflections != null
	var picture: Variant = reflections.manifest.pictures[0] if wanted else null
	if not reflections.show_behind(picture, check):
		panel.say(check.problem)
		return false
	if compared:
		compared.free()
		compared = null
		orbit.make_current()
	if wanted:
		compared = reflections.scene.camera_of(picture, check)
		if compared == null:
			panel.say(check.problem)
			return false
		reflections.scene.root.add_child(compared)
		compared.make_current()
	return true


func _box() -> AABB:
	var box := AABB()
	for mesh in reflections.scene.meshes():
		var own := mesh.global_transform * mesh.get_aabb()
		box = own if not box.has_volume() else box.merge(own)
	return box


## Blender's exporter writes no world and no area lamps: without any light what does not mirror would be black.
func _add_light() -> void:
	world.environment = Environment.new()
	world.environment.background_mode = Environment.BG_COLOR
	world.environment.background_color = Color(0.1, 0.11, 0.12)
	world.environment.ambient_light_source = Environment.AMBIENT_SOURCE_COLOR
	world.environment.ambient_light_color = Color.WHITE
	world.environment.ambient_light_energy = 0.4
	sun.rotation = Vector3(-0.9, 0.6, 0)
	sun.light_energy = 0.6


## --name value, after "--" on the command line.
func _wishes() -> Dictionary:
	var words := OS.get_cmdline_user_args()
	var found := {}
	for k in range(0, words.size() - 1, 2):
		found[words[k].trim_prefix("--")] = words[k + 1]
	return found
