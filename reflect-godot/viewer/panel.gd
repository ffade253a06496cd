## What a person sets: the folder, the method, Blender's camera; and what is said.
extends CanvasLayer

signal folder_chosen(folder: String)
signal method_chosen(method: String)
signal compare_toggled(wanted: bool)

var _methods := OptionButton.new()
var _compare := CheckButton.new()
var _said := Label.new()
var _files := FileDialog.new()


func _ready() -> void:
	var box := VBoxContainer.new()
	box.position = Vector2(12, 12)
	var open := Button.new()
	open.text = "Open Export..."
	open.tooltip_text = "The folder that reflect export wrote"
	open.pressed.connect(func() -> void: _files.popup_centered_ratio(0.7))
	_files.file_mode = FileDialog.FILE_MODE_OPEN_DIR
	_files.access = FileDialog.ACCESS_FILESYSTEM
	_files.dir_selected.connect(func(folder: String) -> void: folder_chosen.emit(folder))
	_methods.tooltip_text = "The method that answers reflections"
	_methods.item_selected.connect(func(k: int) -> void: method_chosen.emit(_methods.get_item_text(k)))
	_compare.text = "From Blender's Camera"
	_compare.tooltip_text = "Cycles' frame without its reflections stands behind those that are drawn here"
	_compare.toggled.connect(func(on: bool) -> void: compare_toggled.emit(on))
	for one: Control in [open, _methods, _compare, _said]:
		one.focus_mode = Control.FOCUS_NONE  # arrow keys turn the view
		box.add_child(one)
	add_child(box)
	add_child(_files)
	say("Open the folder that reflect export wrote.")


func fill(reflections: RefCounted, has_picture: bool) -> void:
	_methods.clear()
	for method: String in reflections.methods():
		_methods.add_item(method)
	_compare.set_pressed_no_signal(false)
	_compare.disabled = not has_picture


func say(sentence: String) -> void:
	_said.text = sentence
