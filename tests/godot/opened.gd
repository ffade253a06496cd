## What reflect-godot says of exports: godot --headless --path reflect-godot -s opened.gd -- LIST.json OUT.json. An entry of the list is {"manifest": file}, only
## checked, or {"folder": ...}, opened and shown by its first method; OUT has a sentence for each, empty where nothing is wrong.
extends SceneTree

const Check := preload("res://addons/reflect/check.gd")
const Manifest := preload("res://addons/reflect/manifest.gd")
const Reflections := preload("res://addons/reflect/reflections.gd")


func _initialize() -> void:
	var words := OS.get_cmdline_user_args()
	var said := []
	for job: Dictionary in JSON.parse_string(FileAccess.get_file_as_string(words[0])):
		var check := Check.new()
		if job.has("manifest"):
			Manifest.parse(FileAccess.get_file_as_string(job.manifest), check)
		else:
			var reflections: Reflections = Reflections.open(job.folder, check)
			if reflections:
				reflections.use(reflections.methods()[0], check)
				reflections.scene.root.free()
		said.append(check.problem)
	FileAccess.open(words[1], FileAccess.WRITE).store_string(JSON.stringify(said))
	quit(0)
