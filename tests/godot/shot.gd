## Draws res://made.scn, by picture.json's camera as res://made.png.
extends SceneTree


func _initialize() -> void:
	_draw.call_deferred()


func _draw() -> void:
	var picture: Dictionary = JSON.parse_string(FileAccess.get_file_as_string("res://picture.json"))
	var scene: Node3D = load("res://made.scn").instantiate()
	root.add_child(scene)
	root.size = Vector2i(int(picture.width), int(picture.height))
	root.transparent_bg = true
	var own: Camera3D = scene.find_children("*", "Camera3D", true, false)[0]
	var camera := Camera3D.new()
	camera.set_perspective(rad_to_deg(2 * atan(1.0 / picture.projection[5])), own.near, own.far)
	scene.add_child(camera)
	camera.global_transform = own.global_transform
	camera.make_current()
	await RenderingServer.frame_post_draw
	await RenderingServer.frame_post_draw
	var image := root.get_texture().get_image()
	image.convert(Image.FORMAT_RGB8)
	image.save_png("res://made.png")
	quit(0)
