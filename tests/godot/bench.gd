## Runs kernels in Godot on rays that lie in textures: godot --path PROJECT -s bench.gd -- FOLDER. FOLDER/jobs.json has for each job the shader's text and its
## textures (raw files); a pixel of the canvas holds the four bytes of one float32, and each of the outputs' numbers is drawn by itself.
extends SceneTree

var _folder: String


func _initialize() -> void:
	_folder = OS.get_cmdline_user_args()[0]
	_run.call_deferred()


func _run() -> void:
	var jobs: Array = JSON.parse_string(FileAccess.get_file_as_string(_folder.path_join("jobs.json")))
	for k in jobs.size():
		await _job(jobs[k], _folder.path_join("got%d" % k))
	quit(0)


func _job(job: Dictionary, out: String) -> void:
	var shader := Shader.new()
	shader.code = job.text
	var material := ShaderMaterial.new()
	material.shader = shader
	for name: String in job.textures:
		var told: Dictionary = job.textures[name]
		var data := FileAccess.get_file_as_bytes(_folder.path_join(told.file))
		var format := Image.FORMAT_RGBAH if told.half else Image.FORMAT_RGBAF
		material.set_shader_parameter(name, ImageTexture.create_from_image(Image.create_from_data(told.width, told.height, false, format, data)))
	var slots := PackedVector4Array()
	for slot: Array in job.slots:
		slots.append(Vector4(slot[0], slot[1], slot[2], slot[3]))
	if slots:
		material.set_shader_parameter(job.block, slots)
	var view := SubViewport.new()
	view.size = Vector2i(job.width, job.height)
	view.transparent_bg = true
	view.disable_3d = true
	view.render_target_update_mode = SubViewport.UPDATE_ALWAYS
	var all := ColorRect.new()
	all.size = view.size
	all.material = material
	view.add_child(all)
	root.add_child(view)
	for number in int(job.numbers):
		material.set_shader_parameter("number", number)
		await RenderingServer.frame_post_draw
		await RenderingServer.frame_post_draw
		var image := view.get_texture().get_image()
		image.convert(Image.FORMAT_RGBA8)
		FileAccess.open("%s_%d" % [out, number], FileAccess.WRITE).store_buffer(image.get_data())
	view.free()
