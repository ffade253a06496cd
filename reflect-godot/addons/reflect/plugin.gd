## Project > Tools > Import Reflect Export...: a folder that reflect export wrote becomes a scene of this project.
@tool
extends EditorPlugin

const Check := preload("check.gd")
const Packed := preload("packed.gd")
const Reflections := preload("reflections.gd")
const ITEM := "Import Reflect Export..."

var _folders := EditorFileDialog.new()
var _methods := PopupMenu.new()
var _said := AcceptDialog.new()
var _folder := ""


func _enter_tree() -> void:
	_folders.file_mode = EditorFileDialog.FILE_MODE_OPEN_DIR
	_folders.access = EditorFileDialog.ACCESS_FILESYSTEM
	_folders.dir_selected.connect(_chosen)
	_methods.index_pressed.connect(func(k: int) -> void: _import(_methods.get_item_text(k)))
	for one: Window in [_folders, _methods, _said]:
		EditorInterface.get_base_control().add_child(one)
	add_tool_menu_item(ITEM, func() -> void: _folders.popup_centered_ratio(0.6))


func _exit_tree() -> void:
	remove_tool_menu_item(ITEM)
	for one: Window in [_folders, _methods, _said]:
		one.queue_free()


func _chosen(folder: String) -> void:
	var check := Check.new()
	var reflections: Reflections = Reflections.open(folder, check)
	if reflections == null:
		return _say(check.problem)
	_folder = folder
	_methods.clear()
	for method: String in reflections.methods():
		_methods.add_item(method)
	reflections.scene.root.free()
	_methods.popup_centered()


func _import(method: String) -> void:
	var check := Check.new()
	var path := "res://%s_%s.scn" % [_folder.get_file().validate_filename(), method]
	if Packed.save(_folder, method, path, check):
		EditorInterface.get_resource_filesystem().scan()
	_say(check.problem if check.problem else "%s was written: drag it into a scene." % path)


func _say(sentence: String) -> void:
	_said.dialog_text = sentence
	_said.popup_centered()
