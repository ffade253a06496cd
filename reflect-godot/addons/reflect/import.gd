## From the command line: godot --headless --path PROJECT -s addons/reflect/import.gd -- EXPORT METHOD res://SCENE.scn
extends SceneTree

const Check := preload("check.gd")
const Packed := preload("packed.gd")


func _initialize() -> void:
	var words := OS.get_cmdline_user_args()
	var check := Check.new()
	if words.size() != 3:
		check.refuse("", "import.gd wants an export's folder, a method and the scene to write")
	elif Packed.save(words[0], words[1], words[2], check):
		print("wrote ", words[2])
	if check.problem:
		printerr(check.problem)
	quit(1 if check.problem else 0)
